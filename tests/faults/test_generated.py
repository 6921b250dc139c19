"""Faults from tables, hundreds of them: no crash, no hang, the right class, the culprit by name."""

import os
import random
import shlex
import shutil

import pytest
from generated.case import CLASSES, Works, all_cases
from generated.stock import PLANTED, compile_kernels, fill

import rom.cli.main as command_line
from cases.paths import ROOT
from rom.errors import QualityGateError, RomError

pytestmark = [pytest.mark.once, pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")]

MOST_CHARACTERS = 5000  # of a message that somebody still reads
CASES = all_cases()
# the share of a class that `make test` runs, least of those that start processes
SHARES = dict.fromkeys("67", 1 / 4) | dict.fromkeys("8R", 1 / 6)


def sampled():
    """All cases, those beyond the share of their class left to `make long`."""
    for letter in CLASSES:
        names = [name for name in CASES if name[0] == letter]
        here = random.Random(letter).sample(names, round(SHARES[letter] * len(names)))
        for name in names:
            long = [pytest.mark.long] * (name not in here)
            fe = [pytest.mark.fenicsx] * CASES[name].fe
            yield pytest.param(CASES[name], id=name, marks=long + fe)


@pytest.fixture(scope="module")
def stock(tmp_path_factory):
    """The folder of valid files, with all compiled that cases call: that is no hang."""
    folder = tmp_path_factory.mktemp("faults") / "stock"
    fill(folder)
    compile_kernels()
    return folder


@pytest.fixture
def folder(stock, tmp_path, monkeypatch):
    """A copy to work in; where it lies and the environment are as before afterwards."""
    shutil.copytree(stock, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))  # of processes that cases start
    before = dict(os.environ)
    yield tmp_path / "here"
    os.environ.clear()
    os.environ.update(before)


@pytest.mark.timeout(60, func_only=True)
@pytest.mark.parametrize("one", [*sampled()])
def test_a_fault_does_no_harm_and_is_refused_by_name(one, folder, capsys, monkeypatch):
    for prepare in one.given:
        prepare(folder)
    before = files(folder)
    error = (called if callable(one.act) else typed)(one.act, folder, monkeypatch)
    err = capsys.readouterr().err
    said = f"{error}\n{err}"
    assert "Traceback" not in err and len(said) <= MOST_CHARACTERS
    assert error or Works in one.accept
    if error:
        assert isinstance(error, one.accept) and error.exit_code != 1, repr(error)
        assert all(text.rstrip().endswith(".") for text in (error.message, error.hint) if text)
        choices = [(x,) if isinstance(x, str) else x for x in one.words]
        assert all(any(word in said for word in words) for words in choices), said
    found = files(folder)
    allowed = before if error and not one.leaves else {f for f in found if f.startswith("here")}
    bad = {name for name in found if PLANTED in name or name.endswith(".part")}
    assert not bad | (found - allowed)


def called(act, folder, _):
    """The `RomError` of a call, or nothing; other errors are failures."""
    try:
        act(folder)
    except RomError as error:
        return error
    return None


def typed(words, _, monkeypatch):
    """The same of a command line, whose exit code is that of the error."""
    raised, translated = [], command_line.translated

    def listen(error):
        raised.append(translated(error))
        return raised[-1]

    monkeypatch.setattr(command_line, "translated", listen)
    code = command_line.main(shlex.split(words))
    error = (raised or [QualityGateError(".")])[0] if code else None
    assert error is None or code == error.exit_code
    return error


def files(folder):
    """Everything below the folder around the working folder."""
    return {str(path.relative_to(folder.parent)) for path in folder.parent.rglob("*")}
