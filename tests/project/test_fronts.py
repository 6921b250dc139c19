"""Fronts of packages: what they say is inside, the names they have, and who imports them."""

import ast
import importlib.util
import re
import subprocess
import sys
from importlib import import_module

import pytest

from cases.files.modules import where_they_run
from cases.paths import ROOT
from rom.lazy import Front

STUBS = {
    ".".join(path.parent.relative_to(ROOT).parts): path
    for path in sorted((ROOT / "rom").rglob("__init__.pyi"))
}
FOLDERS = sorted(path for path in (ROOT / "rom").rglob("__init__.py") if path.parent.name != "rom")
DEMOS = sorted((ROOT / "demos").glob("*.py"))
WRITTEN = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [path for path in WRITTEN if "generated" not in path.parts]


def front_of(package):
    if package.startswith("rom.fe"):
        pytest.importorskip("dolfinx", reason="modules of rom.fe need it")
    return import_module(package)


@pytest.mark.parametrize("package", where_they_run(STUBS))
def test_a_front_has_the_names_of_its_stub_and_shows_no_others(package):
    front = front_of(package)
    lines = [n for n in ast.parse(STUBS[package].read_text()).body if isinstance(n, ast.ImportFrom)]
    own = [line for line in lines if line.module != "typing"]
    assert isinstance(front, Front)
    assert dir(front) == sorted(alias.asname for line in own for alias in line.names)
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        front.nothing  # noqa: B018
    # components show the elements of mechanisms, methods and histories that they are made of, and
    # packages of the core what fields have for users of theirs
    below = ["rom.mbs.elements.", "rom.updating.", "rom.components.histories."]
    below = below if package.startswith("rom.components.") else ["rom.components."]
    inside = (f"{package}.", *below)
    for line in own:
        assert f"{line.module}.".startswith(inside), f"{package}: {line.module} is not in it"
        for alias in line.names:
            assert getattr(front, alias.asname) is getattr(import_module(line.module), alias.name)


NAMESAKES = [  # names that are also those of modules in the same folder
    (package, name, place)
    for package in STUBS
    for name, place in import_module(package).MODULES.items()
    if importlib.util.find_spec(f"{package}.{name}")
]


@pytest.mark.parametrize("first", ["the name", "the module"])
def test_a_name_is_never_the_module_of_the_same_name(first):
    found = {f"{package}.{name}" for package, name, _ in NAMESAKES}
    assert {"rom.prestress.spin_up", "rom.io.export"} < found
    code = f"""
from importlib import import_module
for package, name, place in {NAMESAKES}:
    front = import_module(package)
    {"getattr(front, name)" if first == "the name" else ""}
    import_module(package + "." + name)
    assert getattr(front, name) is getattr(import_module(place), name), (package, name)
"""
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("path", FOLDERS, ids=lambda path: str(path.parent.relative_to(ROOT)))
def test_a_front_says_what_is_inside(path):
    """Every module and folder by its name, and nothing that is not there."""
    folder = path.parent
    said = ast.get_docstring(ast.parse(path.read_text()))
    inside = {p.stem for p in folder.glob("[!_]*.py")}
    inside |= {p.parent.name for p in folder.glob("*/__init__.py")}
    package = import_module(".".join(folder.relative_to(ROOT).parts))
    named = set(re.findall(r"`(\w+)`", said))
    assert inside <= named <= inside | set(getattr(package, "__all__", ())), folder
    assert 3 <= len(said.splitlines()) <= 22


@pytest.mark.parametrize("path", [*DEMOS, *PAGES], ids=lambda path: path.stem)
def test_users_are_shown_short_imports(path):
    """At most two dots; that they work is seen where pages and demos run."""
    assert not re.findall(r"^ *(?:from|import) rom(?:\.\w+){3}.*", path.read_text(), re.M)
