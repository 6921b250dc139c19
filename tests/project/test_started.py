"""Whatever can be started is started: benchmarks, targets of make, commands of pages.

In short forms, small sizes and coarse meshes. What is not in a table here is named.
"""

import importlib.util
import re
import shlex
import shutil

import pytest

import rom
from benchmarks import two_stages
from benchmarks.benchmarks import BENCHMARKS
from cases import command
from cases.command import ROOT, ran
from cases.files.docstrings import PAGES, commands
from cases.files.step_parts import step_part
from cases.solid import block, reduced
from rom.cli.parser import build_parser

pytestmark = pytest.mark.once

COARSE_WHEEL = {"lc": 0.02, "lc_blade": 0.02}
BRIEF = {  # benchmark: arguments with which it takes seconds
    "blade": {"parameters": {"lc": 0.02, "lc_flank": 0.01}},
    "film": {"solves": 4},
    "transmission": {"speeds": 1, "cells": (24, 4), "stage_cells": (24, 3)},
    "geared": {"steps": 50},
    "integrator": {"turns": 1},
    "chain": {"lengths": (2, 4)},
    "adaptive": {"duration": 0.2, "links": 2, "turns": 1, "top_time": 0.005},
    "loops": {"blocks": 3, "steps": 2, "cells": 4, "height": 2},
    "reduction": {"sizes": (3e3,)},
    "large-reduction": {"size": 3e3},
    "many-modes": {"size": 3e3, "counts": (10,)},
    "wheel": {"families": 2, "parameters": COARSE_WHEEL},
    "peers": {"meshes": (0.024,)},
    "motion": {"meshes": (0.024,), "links": (2,)},
    "rods": {"lengths": (10, 20)},
    "stepper": {"steps": 20, "rounds": 1, "pieces": 2},
    "start": {"cases": ("best_matching",), "again": ("best_matching",)},
    "studies": {"cranks": 4, "peers": 2, "shorts": 40},
    "updating": {"sizes": (2e3,)},
    "large-deflection": {
        "size": 2e3, "coarse": (10, 1), "fine": (12, 1), "segments": (10,), "elements": (10,)},
}  # fmt: skip
# without FEniCSx
LIGHT = ("film", "integrator", "chain", "adaptive", "loops", "start", "geared", "stepper")


def test_every_benchmark_has_a_brief_form():
    assert [*BRIEF] == [*BENCHMARKS]


@pytest.mark.long
@pytest.mark.timeout(3600)  # a program to compare with is installed first
@pytest.mark.parametrize("name", BRIEF)
def test_a_benchmark_runs_from_its_beginning_to_its_end(name, monkeypatch):
    """Programs to compare with come from the package index; where that is not, the rest has run."""
    if name not in LIGHT:
        pytest.importorskip("dolfinx", reason="what is measured is meshed")
    monkeypatch.setattr(two_stages, "N_TEETH", 1)
    figures = []
    try:
        figures.extend(BENCHMARKS[name](**BRIEF[name]))
    except rom.ResourceError as error:
        if "could not be made" not in str(error):
            raise
        pytest.skip(str(error))
    assert figures and all(figure.value == figure.value for figure in figures)
    apart = [f for f in figures if f.quantity == "difference of paths"]
    assert all(figure.value < 1e-5 for figure in apart), apart
    assert len(apart) == (3 if name == "motion" else 0)


TARGETS = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.M)
TOGETHER = {  # what a target starts at least: all that is to be checked
    "test": "ruff check .|ruff format --check|mypy|pytest -m fenicsx or once -n|"
    "pytest -m not fenicsx and not once -p",
    "long": "pytest -m long -n|pytest -m not long tests/|pytest -m not fenicsx and once -p",
}
STUB = '#!/bin/sh\nprintf "%s\\n" "$*" >> "{log}"\n'


@pytest.mark.parametrize("target", TARGETS)
def test_a_target_of_make_starts_modules_and_files_that_are_there(target, tmp_path):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    pytest.importorskip("dolfinx", reason="what targets start stands in the other environment")
    for name in ("rom", "tests", "demos", "docs", "benchmarks", "meshes", "pyproject.toml"):
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copy(ROOT / "Makefile", tmp_path)
    log = tmp_path / "log"
    (tmp_path / ".ci").mkdir()
    for program in ("python", ".ci/setup.sh"):
        (tmp_path / program).write_text(STUB.format(log=log))
        (tmp_path / program).chmod(0o755)
    given = [f"PYTHON={tmp_path}/python", f"LIGHT={tmp_path}/python", "NAME=motion"]
    done = ran("make", "-C", tmp_path, target, *given)
    assert done.returncode == 0, done.stderr
    lines = log.read_text().splitlines() if log.exists() else []
    assert lines or target == "clean"
    said = log.read_text() if lines else ""
    assert all(f"-m {part}" in said for part in TOGETHER.get(target, "").split("|") if part)
    for line in lines:
        for module in re.findall(r"-m ([a-z_]+)\b", line)[:1]:
            assert importlib.util.find_spec(module), line
        for file in re.findall(r"\b(?:tests|demos|docs)/\S+\.py", line):
            assert (ROOT / file).is_file(), line
    assert (ROOT / "rom" / "__init__.py").exists()


OTHERS = (  # ways to install, which `.ci/other_systems.sh` goes on systems of their own
    "sudo apt-get install", "/usr/bin/python3 -m venv", "python3 -m venv", ".venv/bin/pip install",
    "conda ", "docker ",
)  # fmt: skip
SHORTER = (  # what a command of a page gets instead, so that it takes seconds and needs no window
    (r"--hinge \d+", "--hinge radius:0.006 -m 4"),
    (r"^(rom \w+ part.step)", r"\1 -p lc=0.005"),
    (r"lc=4e-3", "lc=8e-3"),
    (r"(rom reduce meshes/connecting_rod.geo.*|.* --save rod.inp .*)", r"\1 -p lc=0.012"),
    (r"(rom simulate demos/slider_crank.toml.*)", r"\1 --t-end 0.001"),
    (r"(rom report demos/slider_crank.toml) --move", r"\1"),
    (r"--t-end 1 ", "--t-end 0.01 "),
    (r"^(rom view \S+)$", r"\1 -o view.png"),
    (r"--held foot", "--held root"),
)
NOTHING_TO_RESUME = "there is nothing to resume"


def kind(line):
    if line.startswith("make "):
        return "make" if line.split()[1] in TARGETS else None
    if line.startswith((*OTHERS, "ccx ")):
        return "ccx" if line[:3] == "ccx" else "other systems"
    return "rom" if re.match(r"(\.venv/bin/|mpirun -n \d+ )?rom \w", line) else None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_is_started_by_something(page):
    assert [line for line in commands(page) if kind(line) is None] == []
    for words in (shlex.split(line) for line in commands(page) if kind(line) == "rom"):
        verb = words[words.index("rom") + 1 :] if "rom" in words else words[1:]
        assert build_parser().parse_args(verb).verb == verb[0]


SHOWN = [page for page in PAGES if page.stem != "step_part" and "rom" in map(kind, commands(page))]


def part(path):
    """A plate with a blind bore of 6 mm, which leaves its foot whole."""
    with step_part(path) as occ:
        plate = occ.addBox(-20, -20, 0, 80, 40, 10)
        bore = occ.addCylinder(0, 0, 4, 0, 0, 30, 6)
        occ.cut([(3, plate)], [(3, bore)])


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.parametrize("page", SHOWN, ids=lambda page: page.name)
def test_commands_of_a_page_run_one_after_the_other(page, tmp_path):
    part(tmp_path / "part.step")
    made = reduced(4, block(), reference="root")
    rom.save(made, tmp_path / "jacket.rom.npz")
    solver = shutil.which("ccx")  # writes matrices for the next command
    for line in commands(page):
        if kind(line) == "ccx" and solver:
            ran(*shlex.split(line), cwd=tmp_path, check=True)
        if kind(line) != "rom" or " open " in line or ("rod.sti" in line and not solver):
            continue
        brief = line.removeprefix(".venv/bin/")
        for before, now in SHORTER:
            brief = re.sub(before, now, brief)
        words = shlex.split(brief)
        ranks = int(words[2]) if words[0] == "mpirun" else 1
        done = command.rom(*words[words.index("rom") + 1 :], *["--force"] * ("-o" in words),
                           cwd=tmp_path, timeout=300, n=ranks)  # fmt: skip
        resumed = "--resume" in words and NOTHING_TO_RESUME in done.stderr
        assert done.returncode in (0, 5) or resumed, (brief, done.stderr)
