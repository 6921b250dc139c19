"""Runs cases in this process, one after the other, and says of each what came of it.

``python -P -m generated.runner FOLDER ID...``: one line of JSON when a case begins, and one when it
has ended, so that whoever reads knows which case a process died of.
"""

import contextlib
import io
import json
import os
import shlex
import shutil
import signal
import sys
import warnings
from pathlib import Path
from time import perf_counter
from typing import Any
from unittest import mock

import rom.cli.main as command_line
from generated.case import Case, Wrong, all_cases, planted
from generated.stock import PLANTED
from rom.errors import QualityGateError, RomError, RomWarning


class Hang(BaseException):
    """The time of a case is over."""


def run(one: Case, folder: Path) -> dict[str, Any]:
    """What came of a case."""
    for prepare in one.given:
        prepare(folder)
    before = files(folder)
    start = perf_counter()
    with quietly() as (out, err), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RomWarning)
        act = typed if isinstance(one.act, str) else called
        found = limited(lambda: act(one.act, err), one.seconds)
    told = [str(w.message) for w in caught if issubclass(w.category, RomWarning)]
    told += [x for x in err.getvalue().splitlines() if x.startswith("warning: ")]
    found |= {"warnings": told, "seconds": perf_counter() - start, "stdout": out.getvalue()[:2000]}
    if "Traceback" in err.getvalue():
        found |= {"kind": "foreign", "text": err.getvalue()[-2000:]}
    refused = found["kind"] == "refused" and not one.leaves
    return found | {"harm": harm(folder, before if refused else files(folder))}


def limited(act: Any, seconds: float) -> dict[str, Any]:
    """The outcome of a function that may take so long."""

    def over(*_: Any) -> None:
        raise Hang

    signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        return act()
    except Hang:
        return {"kind": "hang", "class": "", "text": f"more than {seconds:g} s"}
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def called(act: Any, _err: io.StringIO) -> dict[str, Any]:
    """The outcome of a Python call."""
    try:
        value = act(Path.cwd())
    except Wrong as error:
        return {"kind": "wrong", "class": "", "text": str(error)}
    except RomError as error:
        return refusal(error, error.exit_code, str(error))
    except Hang:
        raise
    except BaseException as error:
        return {"kind": "foreign", "class": type(error).__name__, "text": repr(error)}
    return {"kind": "done", "class": "", "text": repr(value)[:200]}


def typed(words: str, err: io.StringIO) -> dict[str, Any]:
    """The outcome of a command line."""
    raised: list[BaseException] = []
    translated = command_line.translated

    def listen(error: BaseException) -> RomError:
        raised.append(error)
        return translated(error)

    with mock.patch.object(command_line, "translated", listen):
        code = command_line.main(shlex.split(words))
    if raised and isinstance(raised[0], Hang):
        raise raised[0]
    if code == 0:
        return {"kind": "done", "class": "", "text": err.getvalue()}
    error = translated(raised[0]) if raised else QualityGateError(".")
    return refusal(error, code, err.getvalue())


def refusal(error: RomError, code: int, text: str) -> dict[str, Any]:
    """A `RomError`; one with exit code 1 is a mistake of ours."""
    kinds = [kind.__name__ for kind in type(error).__mro__]
    kind = "refused" if code == error.exit_code != 1 else "foreign"
    ended = all(said.rstrip().endswith(".") for said in (error.message, error.hint) if said)
    return {"kind": kind, "class": kinds[0], "kinds": kinds, "text": text, "ended": ended}


def files(folder: Path) -> set[str]:
    """Everything below the folder around the working folder."""
    return {str(path.relative_to(folder.parent)) for path in folder.parent.rglob("*")}


def harm(folder: Path, allowed: set[str]) -> list[str]:
    """Files that must not be there: outside, made by planted code, unfinished, or not allowed."""
    inside = folder.name + os.sep
    found = files(folder)
    bad = {name for name in found if name != folder.name and not name.startswith(inside)}
    bad |= {name for name in found if PLANTED in name or name.endswith(".part")}
    return sorted(bad | (found - allowed))


@contextlib.contextmanager
def quietly() -> Any:
    """Texts of stdout and stderr."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        yield out, err


def main() -> None:
    """Run the cases that are named."""
    base, *wanted = sys.argv[1:]
    channel = os.fdopen(os.dup(1), "w", buffering=1)
    silence = os.open(os.devnull, os.O_RDWR)
    for handle in (1, 2):
        os.dup2(silence, handle)
    cases, environment = all_cases() | planted(), dict(os.environ)
    for name in wanted:
        outer = Path(base, "case")
        shutil.rmtree(outer, ignore_errors=True)
        folder = outer / "here"
        shutil.copytree(Path(base, "stock"), folder)
        os.chdir(folder)
        channel.write(json.dumps({"begins": name, "seconds": cases[name].seconds}) + "\n")
        found = run(cases[name], folder)
        channel.write(json.dumps({"id": name} | found) + "\n")
        os.chdir(base)
        os.environ.clear()
        os.environ.update(environment)


if __name__ == "__main__":
    main()
