"""The set-up runs again and again, lists of packages agree; the script that plants errors."""

import ast
import os
import re
import sys
import time
import tomllib
from itertools import chain
from pathlib import Path

import pytest

from cases.command import ran
from cases.files.demos import DEMOS, LONG_DEMOS
from cases.long import LONGEST_FIRST, ONCE
from cases.paths import ROOT, TESTS
from rom.doctor.libraries import PACKAGES, SLOW_ADVICE, SYSTEM_COMMAND
from rom.fe import DEBIAN_PACKAGES, GMSH_LIBRARIES, WHEEL_PACKAGES

sys.path.insert(0, str(ROOT / ".ci"))
import plant

pytestmark = pytest.mark.once
SETUP = ROOT / ".ci" / "setup.sh"
OTHER_SYSTEMS = ROOT / ".ci" / "other_systems.sh"


def packages(script):
    return set(re.search(r'packages="([^"]+)"', script.read_text()).group(1).split())


def names_of(requirements):
    return {re.split(r"[<>=!~ ;\[]", requirement)[0] for requirement in requirements}


def function_of(name):
    return re.search(rf"^{name}\(\) \{{.*?^\}}$", SETUP.read_text(), re.S | re.M).group()


def deny_network(folder):
    """An environment in which everything that would fetch or install something fails."""
    for name in ("apt-get", "sudo", "curl", "wget"):
        (folder / name).write_text("#!/bin/sh\nexit 99\n")
        (folder / name).chmod(0o755)
    nowhere = "http://127.0.0.1:9"
    return os.environ | {
        "PATH": f"{folder}:{os.environ['PATH']}", "PIP_NO_INDEX": "1", "PIP_RETRIES": "0",
        "http_proxy": nowhere, "https_proxy": nowhere,
    }  # fmt: skip


def test_a_second_run_takes_seconds_and_no_network(tmp_path):
    stamps = [ROOT / name / ".stamp" for name in (".venv", ".venv-light")]
    if not all(stamp.exists() for stamp in stamps):
        pytest.skip("this tree was not set up with 'make setup'")
    before = [stamp.stat().st_mtime_ns for stamp in stamps]
    start = time.perf_counter()
    done = ran(SETUP, env=deny_network(tmp_path))
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert time.perf_counter() - start < 30
    assert [stamp.stat().st_mtime_ns for stamp in stamps] == before


def test_a_system_without_debian_packages_is_told_so(tmp_path):
    for name in ("sh", "dirname"):
        (tmp_path / name).symlink_to(f"/bin/{name}" if name == "sh" else f"/usr/bin/{name}")
    done = ran("/bin/sh", SETUP, env={"PATH": str(tmp_path)})
    assert done.returncode == 1
    assert "no Debian" in done.stderr and "README" in done.stderr


def test_programs_to_compare_with_are_not_needed(tmp_path):
    script = "set -eu\noptional=calculix-ccx\ninstalled() { false; }\n"
    script += function_of("try_optional") + "\ntry_optional\n"
    done = ran("sh", "-c", script, env=deny_network(tmp_path))
    assert (done.returncode, done.stdout) == (0, "")
    assert "not installed: calculix-ccx; some tests are skipped" in done.stderr


def compile_ahead(folder, code, sources="one"):
    """Exit code and calls of Python of the function of the script, with a Python that ends so."""
    python = folder / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True, exist_ok=True)
    python.write_text(f'#!/bin/sh\necho "$@" >>calls\nexit {code}\n')
    python.chmod(0o755)
    (folder / "calls").write_text("")
    script = f"set -eu\nmade_of={sources}\n{function_of('compile_ahead')}\n"
    script += "compile_ahead .venv || exit 9\n"
    done = ran("sh", "-c", script, cwd=folder)
    return done.returncode, (folder / "calls").read_text().splitlines()


def test_what_first_motions_need_is_compiled_until_it_is_and_when_sources_change(tmp_path):
    asked = ["-m rom doctor --compile demo"]
    assert compile_ahead(tmp_path, 5) == (9, asked)
    assert compile_ahead(tmp_path, 0) == (0, asked)
    assert compile_ahead(tmp_path, 5) == (0, [])
    assert compile_ahead(tmp_path, 0, "two") == (0, asked)
    assert SETUP.read_text().count("compiled for .venv") == 2  # both environments, or an error


def test_scripts_are_valid_shell_and_what_waits_for_make_long_exists():
    for script in (ROOT / ".ci" / "run", *(ROOT / ".ci").glob("*.sh")):
        assert os.access(script, os.X_OK), f"{script} is not executable"
        ran("sh", "-n", script, check=True)
    assert (ROOT / ".ci" / "run").read_text().endswith("\nexec make test\n")
    assert [name for name in (*LONGEST_FIRST, *ONCE) if not (TESTS / name).exists()] == []
    assert {demo.stem for demo in DEMOS} > LONG_DEMOS
    importing = {path for path in TESTS.rglob("*.py") if "cases.long" in path.read_text()}
    apart = {TESTS / "conftest.py", Path(__file__)}
    assert all(path.name.startswith("test_") for path in importing - apart)


def test_lists_of_packages_agree():
    """Pip cannot see Debian's gmsh and h5py, and would put other builds in front of them."""
    setup, by_pip = packages(SETUP), packages(OTHER_SYSTEMS)
    of_debian = {debian for debian, _ in PACKAGES.values()} | set(DEBIAN_PACKAGES.split())
    cures = {word for word in f"{SYSTEM_COMMAND} {SLOW_ADVICE}".split() if word[:3] == "lib"}
    assert cures | of_debian <= setup | {"python3-mpi4py"}  # comes with petsc4py
    recipe = (ROOT / "Dockerfile").read_text()
    install = re.search(r"--no-install-recommends(.+?)&&", recipe, re.S).group(1)
    assert set(install.replace("\\", " ").split()) == setup
    page = " ".join((ROOT / "docs" / "install.md").read_text().replace("\\\n", " ").split())
    install = re.search(r"apt-get install (gcc [^`]+?) python3 -m venv", page).group(1)
    assert set(install.split()) == by_pip > {*GMSH_LIBRARIES.split(), *SYSTEM_COMMAND.split()[3:]}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    wheels = names_of(extras.pop("fe"))
    told = {name for _, names in PACKAGES.values() for name in names.split()}
    assert wheels == set(WHEEL_PACKAGES.split()) == told - {"mpi4py", "mpich"}  # they come along
    for file in (OTHER_SYSTEMS, ROOT / "README.md", ROOT / "docs" / "install.md"):
        assert ".[fe,view" in file.read_text()
    for file in (SETUP, ROOT / "Dockerfile", ROOT / "Makefile"):
        assert not re.search(r"\[[\w,]*\bfe\b", file.read_text())
    usual = names_of([*project["dependencies"], *chain(*extras.values())])
    shadowing = {*wheels, *"gmsh h5py petsc4py slepc4py mpi4py meshio fenics-dolfinx".split()}
    assert not usual & shadowing and {"numpy", "scipy", "numba"} <= usual


@pytest.mark.long
def test_what_it_plants_is_python_and_has_tests():
    for path in plant.files():
        text, name = path.read_text(), str(path.relative_to(ROOT))
        for nodes in plant.places(text):
            for node in nodes[:1] + nodes[-1:]:
                changed = ast.parse(plant.planted(text, node))
                assert ast.dump(changed) != ast.dump(ast.parse(text)), name
        assert all((ROOT / test).exists() for test in plant.tests_of(name)), name
