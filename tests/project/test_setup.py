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
from cases.long import LONGEST_FIRST, ONCE
from cases.paths import ROOT, TESTS
from rom.doctor.libraries import PACKAGES, SLOW_ADVICE, SYSTEM_COMMAND
from rom.fe import DEBIAN_PACKAGES, GMSH_LIBRARIES, WHEEL_PACKAGES

sys.path.insert(0, str(ROOT / ".ci"))
import plant

pytestmark = pytest.mark.once
SETUP = ROOT / ".ci" / "setup.sh"
OTHER_SYSTEMS = ROOT / ".ci" / "other_systems.sh"


def packages():
    return re.search(r'packages="([^"]+)"', SETUP.read_text()).group(1).split()


def name_of(requirement):
    return re.split(r"[<>=!~ ;\[]", requirement)[0]


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
    """The function of the script, where nothing is installed and nothing can be."""
    function = re.search(r"^try_optional\(\) \{.*?^\}$", SETUP.read_text(), re.S | re.M).group()
    script = f"set -eu\noptional=calculix-ccx\ninstalled() {{ false; }}\n{function}\ntry_optional\n"
    done = ran("sh", "-c", script, env=deny_network(tmp_path))
    assert (done.returncode, done.stdout) == (0, "")
    assert "not installed: calculix-ccx; some tests are skipped" in done.stderr
    assert 'optional="calculix-ccx chromium"' in SETUP.read_text()


def compile_ahead(folder, code, sources="one"):
    """Exit code and calls of Python of the function of the script, with a Python that ends so."""
    function = re.search(r"^compile_ahead\(\) \{.*?^\}$", SETUP.read_text(), re.S | re.M).group()
    python = folder / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True, exist_ok=True)
    python.write_text(f'#!/bin/sh\necho "$@" >>calls\nexit {code}\n')
    python.chmod(0o755)
    (folder / "calls").write_text("")
    script = f"set -eu\nmade_of={sources}\n{function}\ncompile_ahead .venv || exit 9\n"
    done = ran("sh", "-c", script, cwd=folder)
    return done.returncode, (folder / "calls").read_text().splitlines()


def test_what_first_motions_need_is_compiled_until_it_is_and_when_sources_change(tmp_path):
    asked = ["-m rom doctor --compile demo"]
    assert compile_ahead(tmp_path, 5) == (9, asked)
    assert compile_ahead(tmp_path, 0) == (0, asked)
    assert compile_ahead(tmp_path, 5) == (0, [])
    assert compile_ahead(tmp_path, 0, "two") == (0, asked)
    assert SETUP.read_text().count("compiled for .venv") == 2  # both environments, or an error


def test_scripts_are_valid_shell():
    for script in (ROOT / ".ci" / "run", *(ROOT / ".ci").glob("*.sh")):
        assert os.access(script, os.X_OK), f"{script} is not executable"
        ran("sh", "-n", script, check=True)


def recipe(target):
    """What a target of make does."""
    makefile = (ROOT / "Makefile").read_text()
    return makefile.partition(f"\n{target}: setup\n")[2].partition("\n\n")[0] + "\n"


def test_ci_runs_make_test_which_covers_style_types_and_both_environments():
    assert (ROOT / ".ci" / "run").read_text().endswith("\nexec make test\n")
    for part in ("ruff check", "ruff format --check", "-m mypy",
                 '$(PYTHON) -m pytest -m "fenicsx or once" $(SIDE_BY_SIDE)\n',
                 '$(LIGHT) -m pytest -m "not fenicsx and not once" -p'):  # fmt: skip
        assert part in recipe("test")


def test_what_begins_exists_and_what_waits_for_make_long_is_run_there():
    """A file under another name would come last again; `make long` finds files by what they say."""
    assert [name for name in (*LONGEST_FIRST, *ONCE) if not (TESTS / name).exists()] == []
    importing = {path for path in TESTS.rglob("*.py") if "cases.long" in path.read_text()}
    apart = {TESTS / "conftest.py", Path(__file__)}
    assert all(path.name.startswith("test_") for path in importing - apart)
    assert "grep -rlE 'ROM_LONG|SHARED_BY' tests" in (ROOT / "Makefile").read_text()
    assert "ROM_LONG=1 $(PYTHON) -m pytest -m long" in recipe("long-marked")
    assert 'ROM_LONG=1 $(PYTHON) -m pytest -m "not long" $(MORE)' in recipe("long-more")
    assert 'ROM_LONG=1 $(LIGHT) -m pytest -m "not fenicsx and once"' in recipe("long-light")


def test_the_doctor_advises_packages_the_setup_installs():
    advised = {
        word for text in (SYSTEM_COMMAND, SLOW_ADVICE) for word in text.split() if word[:3] == "lib"
    }
    known = {*packages(), "python3-mpi4py"}  # comes with petsc4py
    assert advised and advised | {debian for debian, _ in PACKAGES.values()} <= known
    assert set(DEBIAN_PACKAGES.split()) <= known


def test_the_way_in_by_pip_alone_is_told_the_same_everywhere():
    """The extra, what is advised where it is missing, the script that tries it, and the page."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    brought = [name_of(r) for r in project["optional-dependencies"]["fe"]]
    assert brought == WHEEL_PACKAGES.split()
    fenicsx = {name for _, names in PACKAGES.values() for name in names.split()}
    assert fenicsx - {"mpi4py", "mpich"} == set(brought)  # these two come with FEniCSx
    script = " ".join(OTHER_SYSTEMS.read_text().split())
    page = " ".join((ROOT / "docs" / "install.md").read_text().replace("\\\n", " ").split())
    needed = set(re.search(r'packages="([^"]+)"', script).group(1).split())
    install = re.search(r"apt-get install (gcc [^`]+?) python3 -m venv", page).group(1)
    assert set(install.split()) == needed
    assert needed > {*GMSH_LIBRARIES.split(), *SYSTEM_COMMAND.split()[3:]}
    assert ".[fe,view,dev]" in script and ".[fe,view]" in page
    assert ".[fe,view]" in (ROOT / "README.md").read_text()


def test_pip_does_not_shadow_what_debian_provides():
    """pip cannot see Debian's gmsh and h5py, and would put other builds in front of them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    apart = extras.pop("fe")
    for recipe in (SETUP, ROOT / "Dockerfile", ROOT / "Makefile"):
        assert not re.search(r"\[[\w,]*\bfe\b", recipe.read_text())
    wanted = [*project["dependencies"], *chain(*extras.values())]
    names = {name_of(requirement) for requirement in wanted}
    assert not names & {name_of(requirement) for requirement in apart}
    debian = "gmsh h5py petsc4py slepc4py mpi4py meshio fenics-dolfinx"
    assert not names & set(debian.split()) and {"numpy", "scipy", "numba"} <= names


PLANTED_IN = """
@inner
def f(x, k, out):
    out[k + 1] += 2.0 * x - x[k - 1] / 3.0
    return k + 1

def g(x):
    return x + x

def law(x):
    return x - 0.5

compiled_law(law)
"""


def test_it_plants_one_sign_or_factor_of_compiled_functions_alone():
    signs, factors, _ = plant.places(PLANTED_IN)
    found = [[ast.unparse(node) for node in nodes] for nodes in (signs, factors)]
    assert found == [
        ["out[k + 1] += 2.0 * x - x[k - 1] / 3.0", "2.0 * x - x[k - 1] / 3.0", "x - 0.5"],
        ["2.0 * x", "x[k - 1] / 3.0"],
    ]
    changed = [plant.planted(PLANTED_IN, node) for node in (*signs[:2], *factors)]
    assert [text.splitlines()[3].strip() for text in changed] == [
        "out[k + 1] -= (2.0 * x - x[k - 1] / 3.0)",
        "out[k + 1] += ((2.0 * x) + (x[k - 1] / 3.0))",
        "out[k + 1] += (2.0 * (2.0 * x)) - x[k - 1] / 3.0",
        "out[k + 1] += 2.0 * x - (2.0 * (x[k - 1] / 3.0))",
    ]


@pytest.mark.long
def test_what_it_plants_is_python_and_has_tests():
    for path in plant.files():
        text, name = path.read_text(), str(path.relative_to(ROOT))
        for nodes in plant.places(text):
            for node in nodes[:1] + nodes[-1:]:
                changed = ast.parse(plant.planted(text, node))
                assert ast.dump(changed) != ast.dump(ast.parse(text)), name
        assert all((ROOT / test).exists() for test in plant.tests_of(name)), name
