"""What people read is true: README code runs, messages are filled in, names and fronts exist."""

import ast
import importlib.util
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

import rom
from cases.command import ROOT, ran
from cases.files.docstrings import DEMOS, INSIDE, PAGES
from rom import errors
from rom.cli.parser import EXIT_CODES
from rom.lazy import Front

README = (ROOT / "README.md").read_text()


def files():
    """Text files of the project; those git knows where there is a repository."""
    found = ran("git", "ls-files", "-co", "--exclude-standard", cwd=ROOT)
    names = found.stdout.splitlines() or [p.relative_to(ROOT) for p in ROOT.rglob("*.py")]
    endings = {".py", ".md", ".toml", ".txt", ".sh", ".geo", ""}
    return [ROOT / n for n in names if Path(n).suffix in endings and (ROOT / n).is_file()]


@pytest.mark.fenicsx
def test_first_readme_block_runs(monkeypatch, tmp_path):
    block = re.search(r"```python\n(.*?)```", README, re.S).group(1)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {"__name__": "__main__"})
    assert len(block.splitlines()) <= 15
    assert len(README.splitlines()) <= 150


def test_every_error_is_caught_by_its_name_and_has_an_exit_code_the_help_explains():
    kinds = [e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, Exception)]
    assert all(getattr(rom, kind.__name__) is kind for kind in kinds)
    codes = {e.__name__: e.exit_code for e in kinds if hasattr(e, "exit_code")}
    assert codes.pop("RomError") == 1
    assert set(codes.values()) == {2, 3, 4, 5, 6, 7}
    documented = re.findall(r"^ +(\d) ", EXIT_CODES, re.M)
    assert documented == [str(code) for code in range(8)]


FILES, MODULES = files(), sorted((ROOT / "rom").rglob("*.py"))
USERS_READ = [*PAGES, *DEMOS]
HOSTS = r"\b(pypi|pythonhosted|deb\.debian|anaconda|conda\.io|dockerhub|docker\.io)\b"
PRIVATE = r"\bnumba\.(core|np|_\w+)\b|\bllvmlite\b|\.overloads\b|\bcall_conv\b"
NOWHERE = {  # what no line may have: a pattern, in which files, but for those
    "a place": (r"(?<![\w.~$-])/(home|root|tmp|work|mnt|Users|private)/\w", FILES, __file__),
    "a host": (HOSTS, FILES, __file__),
    "a gap": (r"\b(TODO|FIXME|XXX|raise NotImplementedError)\b", FILES, __file__),
    # numbers of frames are wrong as soon as a function between gets a decorator
    "another way to warn": (r"warnings\.warn\(", MODULES, "rom/errors.py"),
    # the front of that folder says what to do when Numba moves
    "what is private to Numba": (PRIVATE, MODULES, "rom/mbs/compiler/"),
    # at most two dots; that they work is seen where pages and demos run
    "a long import": (r"^ *(from|import) rom(\.\w+){3}", USERS_READ, "none"),
    "an inner front": (rf"from ({'|'.join(INSIDE)}) import", USERS_READ, "none"),
    # what tests share lies in cases
    "a test of another": (r"^ *(from|import) test_", (ROOT / "tests").rglob("*.py"), "none"),
}


@pytest.mark.once
@pytest.mark.parametrize("what", NOWHERE)
def test_no_file_has(what):
    pattern, paths, apart = NOWHERE[what]
    bad = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in paths
        if apart not in str(path)
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if re.search(pattern, line)
    ]
    assert not bad, "\n".join(bad)


STUBS = {
    ".".join(path.parent.relative_to(ROOT).parts): path
    for path in sorted((ROOT / "rom").rglob("__init__.pyi"))
}


@pytest.mark.parametrize(
    "package",
    [pytest.param(n, marks=[pytest.mark.fenicsx] * n.startswith("rom.fe")) for n in STUBS],
)
def test_a_front_has_the_names_of_its_stub_and_shows_no_others(package):
    front = import_module(package)
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
    done = ran(sys.executable, "-W", "ignore", "-c", code)
    assert done.returncode == 0, done.stderr
