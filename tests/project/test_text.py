"""What people read is true: README code runs, messages are filled in, names exist."""

import inspect
import re
import subprocess
from pathlib import Path

import pytest

import rom
from cases.paths import ROOT
from rom import errors
from rom.cli.parser import EXIT_CODES, verb_modules

PLACES = re.compile(r"(?<![\w.~$-])/(home|root|tmp|work|mnt|Users|private)/\w")
HOSTS = re.compile(r"\b(pypi|pythonhosted|deb\.debian|anaconda|conda\.io|dockerhub|docker\.io)\b")
UNFINISHED = re.compile(r"\b(TODO|FIXME|XXX|raise NotImplementedError)\b")


def readme():
    return (ROOT / "README.md").read_text()


def files():
    """Text files of the project; those git knows where there is a repository."""
    found = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    names = found.stdout.splitlines() or [p.relative_to(ROOT) for p in ROOT.rglob("*.py")]
    endings = {".py", ".md", ".toml", ".txt", ".sh", ".geo", ""}
    return [ROOT / n for n in names if Path(n).suffix in endings and (ROOT / n).is_file()]


@pytest.mark.fenicsx
def test_first_readme_block_runs(monkeypatch, tmp_path):
    block = re.search(r"```python\n(.*?)```", readme(), re.S).group(1)
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {"__name__": "__main__"})
    assert len(block.splitlines()) <= 15
    assert len(readme().splitlines()) <= 150


def test_commands_in_the_readme_and_on_pages_exist():
    """Every line that starts with rom, with verbs and options the parser knows."""
    from rom.cli.parser import build_parser

    pages = (readme(), *(path.read_text() for path in (ROOT / "docs").glob("*.md")))
    text = "\n".join(pages).replace("\\\n", " ")
    lines = re.findall(r"^(?:mpirun -n \d )?rom (.+)$", text, re.M)
    assert len(lines) >= len(verb_modules())
    for line in lines:
        words = re.sub(r"\s+#.*", "", line).split()
        assert build_parser().parse_args(words).verb == words[0]


def test_public_names_exist_and_are_documented():
    for name in rom.__all__:
        thing = getattr(rom, name)
        text = inspect.getdoc(thing) or ""
        assert len(text) > 20, name
        if inspect.isfunction(thing) and inspect.signature(thing).parameters:
            assert "Args:" in text, f"{name} does not document its arguments"


def test_every_error_is_caught_by_its_name_and_has_an_exit_code_the_help_explains():
    """DESIGN of the codes: 1 is ours; everything raised on purpose has another one."""
    kinds = [e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, Exception)]
    assert all(getattr(rom, kind.__name__) is kind for kind in kinds)
    codes = {e.__name__: e.exit_code for e in kinds if hasattr(e, "exit_code")}
    assert codes.pop("RomError") == 1
    assert set(codes.values()) == {2, 3, 4, 5, 6, 7}
    documented = re.findall(r"^ +(\d) ", EXIT_CODES, re.M)
    assert documented == [str(code) for code in range(8)]


@pytest.mark.once
def test_no_file_names_one_machine_or_leaves_a_gap():
    bad = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in files()
        if path != Path(__file__)
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if PLACES.search(line) or HOSTS.search(line) or UNFINISHED.search(line)
    ]
    assert not bad, "\n".join(bad)
