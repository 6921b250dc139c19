"""What is shipped is complete: sdist to wheel to a folder where only the light half can work."""

import os
import re
import shutil
import sys
import tomllib
import zipfile
from email.parser import Parser
from pathlib import Path

import numpy as np
import pytest

import rom
from cases.command import ROOT, ran
from cases.solid import block, reduced

pytest.importorskip("wheel", reason="setuptools of Debian 12 needs wheel to make one")
HEAVY = ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio", "matplotlib", "pyvista")
L1, L2, SPEED = 0.1, 0.3, 50.0
SLIDER_CRANK = f"""
import sys
sys.modules.update(dict.fromkeys({HEAVY}))
import rom
mech = rom.Mechanism()
crank = mech.add_rigid("crank", mass=0.5, inertia=(1e-4, 1e-3, 1e-3), at=({L1 / 2}, 0, 0),
                       markers={{"main": (-{L1 / 2}, 0, 0), "pin": ({L1 / 2}, 0, 0)}})
rod = mech.add_flexible("rod", rom.load("rod.rom.npz"), at=({L1}, 0, 0))
slider = mech.add_rigid("slider", mass=0.4, inertia=(1e-4,) * 3, at=({L1 + L2}, 0, 0),
                        markers={{"pin": (0, 0, 0)}})
ground = mech.ground
mech.revolute("main", ground.marker((0, 0, 0)), crank.marker("main"), axis=(0, 0, 1))
mech.revolute("big end", crank.marker("pin"), rod.marker("root"), axis=(0, 0, 1))
mech.spherical("small end", rod.marker("tip"), slider.marker("pin"))
mech.prismatic("guide", ground.marker(({L1 + L2}, 0, 0)), slider.marker("pin"), axis=(1, 0, 0))
mech.drive("motor", "main", lambda t: {SPEED} * t)
sol = rom.simulate(mech, t_end=2e-3, dt=1e-4, assemble=True)
print(rom.__file__)
print(*sol.position("slider")[:, 0])
"""


def hook(name, folder, out):
    code = f"from setuptools import build_meta; print(build_meta.{name}({str(out)!r}))"
    done = ran(sys.executable, "-c", code, cwd=folder, timeout=600, check=True)
    return out / done.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    """Sdist of a clean copy, and the wheel made from it."""
    folder = tmp_path_factory.mktemp("shipped")
    tree = folder / "tree"
    tree.mkdir()
    for name in ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree)
    for name in ("rom", "benchmarks", "demos", "meshes"):
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
    sdist = hook("build_sdist", tree, folder)
    shutil.unpack_archive(sdist, folder / "unpacked")
    wheel = hook("build_wheel", next((folder / "unpacked").iterdir()), folder)
    return sdist, wheel


@pytest.fixture(scope="module")
def installed(shipped, tmp_path_factory):
    """Folder with nothing but what pip takes out of the wheel."""
    folder = tmp_path_factory.mktemp("installed")
    options = "--no-deps --no-index --disable-pip-version-check --no-compile --target".split()
    ran(sys.executable, "-m", "pip", "install", "-q", *options, folder, shipped[1], check=True)
    return folder


def started(place, folder, *words):
    # 20 steps in plain Python take a second; a fresh place would compile for two minutes
    env = os.environ | {"PYTHONPATH": str(place), "NUMBA_DISABLE_JIT": "1"}
    return ran(sys.executable, *words, cwd=folder, env=env, timeout=600)


@pytest.mark.once
def test_the_wheel_holds_every_module_and_its_data(shipped):
    names = set(zipfile.ZipFile(shipped[1]).namelist())
    files = [p for p in (ROOT / "rom").rglob("*") if p.is_file() and "__pycache__" not in p.parts]
    wanted = {str(p.relative_to(ROOT)) for p in files}
    examples = [*ROOT.glob("demos/*.[pt][yo]*"), *ROOT.glob("meshes/*.*")]
    wanted |= {f"rom/examples/{p.relative_to(ROOT)}" for p in examples}
    parts = ("blade", "elements", "profiles")
    tables = {f"rom/components/wind/nrel5mw_{name}.csv" for name in parts}
    assert {"rom/py.typed", *tables} <= wanted <= names
    assert not {n for n in names if not n.startswith(("rom/", "fenicsx_rom-"))}


def test_the_wheel_asks_pip_for_three_libraries_and_has_the_command(shipped, installed, tmp_path):
    with zipfile.ZipFile(shipped[1]) as wheel:
        (text,) = (wheel.read(n) for n in wheel.namelist() if n.endswith("METADATA"))
    metadata = Parser().parsestr(text.decode())
    needed = [r for r in metadata.get_all("Requires-Dist") if "extra" not in r]
    assert {re.match(r"\w+", r).group() for r in needed} == {"numpy", "scipy", "numba"}
    assert metadata["Version"] == rom.__version__
    done = started(installed, tmp_path, installed / "bin" / "rom", "--version")
    assert done.stdout.split() == ["rom", rom.__version__], done.stderr


def test_examples_are_found_installed_as_in_a_clone_and_copied_once(installed, tmp_path):
    for place, home in ((installed, installed / "rom" / "examples"), (ROOT, ROOT)):
        words = ("-P", "-m", "rom", "demo", "--copy", "-o", place.name)
        for _ in range(2):  # the same again is no harm, another file of that name is kept
            assert started(place, tmp_path, *words).returncode == 0
        for kind, name in (("demos", "demo_beam.py"), ("meshes", "beam.geo")):
            copy = tmp_path / place.name / kind / name
            assert copy.read_bytes() == (home / kind / name).read_bytes()
        copy.write_text("mine")
        done = started(place, tmp_path, *words)
        assert done.returncode == 2 and f"{copy.name} is there already" in done.stderr
        assert copy.read_text() == "mine"
        done = started(place, tmp_path, "-P", "-c", "import rom; print(rom.example('beam.geo'))")
        assert done.stdout.strip() == str(home / "meshes" / "beam.geo")


def test_benchmarks_are_in_the_source_and_said_to_be_where_they_are_not(installed, tmp_path):
    said = {}
    for place in (installed, ROOT):
        said[place] = started(place, tmp_path, "-P", "-m", "rom", "bench", "--list")
    assert said[installed].returncode == 2
    assert "Benchmarks come with the source of rom" in said[installed].stderr
    assert "make bench NAME=motion" in said[installed].stderr
    assert said[ROOT].returncode == 0 and "motion " in said[ROOT].stdout


def test_a_saved_slider_crank_runs_from_the_wheel_alone(installed, tmp_path):
    """The slider is where rigid kinematics has it: the chord of a stiff rod keeps its length."""
    rod = reduced(2, block(size=(L2, 0.02, 0.02), cells=(12, 1, 1)), reference=("root", "tip"))
    rom.save(rod, tmp_path / "rod.rom.npz")
    done = started(installed, tmp_path, "-c", SLIDER_CRANK)
    assert done.returncode == 0, done.stderr
    place, line = done.stdout.splitlines()[-2:]
    assert Path(place).is_relative_to(installed)
    x = np.array(line.split(), dtype=float)
    angle = SPEED * np.linspace(0, 2e-3, x.size)
    exact = L1 * np.cos(angle) + np.sqrt(L2**2 - (L1 * np.sin(angle)) ** 2)
    assert x == pytest.approx(exact, abs=5e-6)  # inertia bends and shortens the rod
    assert np.ptp(x) > 5e-4


def test_versions_agree_everywhere_and_what_the_image_copies_is_sent():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = (ROOT / "CITATION.cff").read_text()
    changes = (ROOT / "CHANGELOG.md").read_text()
    newest, day = re.search(r"^## (\d+\.\d+\.\d+), (\d{4}-\d\d-\d\d)$", changes, re.M).groups()
    assert f"\nversion: {newest}\ndate-released: {day}\n" in citation
    assert project["version"] == newest == rom.__version__
    assert f"license: {project['license']['text']}" in citation
    recipe, sent = ((ROOT / name).read_text() for name in ("Dockerfile", ".dockerignore"))
    words = " ".join(re.findall(r"^COPY (.+) \S+$", recipe, re.M)).split()
    assert words and all(f"!{word}\n" in sent for word in words)
