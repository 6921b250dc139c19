"""Runs all cases in processes of their own, judges each, and counts."""

import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cases.paths import TESTS
from generated.case import CLASSES, Case, Silent, Warned, Works, all_cases, case, planted, require
from rom.errors import ConfigError, MeshError

MOST_CHARACTERS = 5000  # of a message that somebody still reads
GRACE = 10.0  # s, beyond the time of a case, until its process is stopped
HERE = TESTS / "faults"


@dataclass(frozen=True)
class Verdict:
    """What a case came to.

    Attributes:
        id: class and name.
        survived: no crash, no hang, no exception but a `RomError`.
        right: one of the accepted outcomes, and no file that must not be there.
        named: the words stand in the message; None where nothing was to be said.
        ended: message and hint of an error end with a full stop.
        told: what was observed, in a line.
    """

    id: str
    survived: bool
    right: bool
    named: bool | None
    ended: bool
    told: str


def verdicts(folder: Path, wanted: list[str]) -> list[Verdict]:
    """The verdict on each case, in order."""
    cases = all_cases() | planted()
    found = {line["id"]: line for line in observed(folder, wanted)}
    return [judged(name, cases[name], found[name]) for name in wanted]


def judged(name: str, one: Case, found: dict[str, Any]) -> Verdict:
    """The verdict on what was observed of a case."""
    kind, harm = found["kind"], found.get("harm", [])
    said = found["text"] if kind == "refused" else " ".join(found.get("warnings", []))
    has = all(any(w in said for w in ((x,) if isinstance(x, str) else x)) for x in one.words)
    right = not harm and len(said) <= MOST_CHARACTERS and accepted(one, found, has)
    speaks = kind == "refused" or (kind == "done" and found["warnings"] and Works not in one.accept)
    told = f"{kind} {found['class']}" + (f", left {harm}" if harm else "")
    lines = " ".join((found["text"] if kind != "done" else said).split())
    return Verdict(
        name, kind in ("done", "refused", "wrong"), right, has if speaks else None,
        found.get("ended", True), f"{told}: {lines[:400]}",
    )  # fmt: skip


def accepted(one: Case, found: dict[str, Any], has: bool) -> bool:
    """Whether an outcome is among those accepted."""
    if found["kind"] == "refused":
        return any(kind.__name__ in found["kinds"] for kind in one.accept)
    if found["kind"] != "done":
        return False
    warned = bool(found["warnings"]) and has
    return (
        Works in one.accept
        or (Warned in one.accept and warned)
        or (Silent in one.accept and not found["warnings"])
    )


def observed(folder: Path, wanted: list[str]) -> Iterator[dict[str, Any]]:
    """What came of each case; a process that dies is followed by another one."""
    rest = list(wanted)
    while rest:
        current = ""
        for line in lines_of(folder, rest):
            if "begins" in line:
                current = line["begins"]
                continue
            if line.get("id", current) == current:
                rest.remove(current)
                yield {"id": current, "warnings": []} | line
                current = ""
        if current in rest:
            raise AssertionError(f"the runner ended without a word on {current}")


def lines_of(folder: Path, wanted: list[str]) -> Iterator[dict[str, Any]]:
    """Lines of a runner, and one for its death."""
    command = [sys.executable, "-P", "-m", "generated.runner", str(folder), *wanted]
    log = folder / "stderr"
    with log.open("wb") as err:
        runner = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=err, stdin=subprocess.DEVNULL, cwd=folder,
            env=environment(),
        )  # fmt: skip
    seconds, running = 60.0, False
    try:
        while True:
            line = read_line(runner, seconds + GRACE)
            if line is None:
                yield {"kind": "hang", "class": "", "text": f"no answer after {seconds:g} s"}
                return
            if not line:
                break
            told = json.loads(line)
            running, seconds = "begins" in told, told["seconds"] if "begins" in told else 60.0
            yield told
        code = runner.wait(60)
        if running:
            yield {"kind": "crash", "class": "", "text": f"ended with {code}: {log.read_text()}"}
        elif code:
            raise AssertionError(f"the runner ended with {code}: {log.read_text()[-3000:]}")
    finally:
        runner.kill()
        runner.wait()
        runner.stdout.close()


def read_line(runner: Any, seconds: float) -> bytes | None:
    """A line, nothing at the end, None when time is over."""
    if not select.select([runner.stdout], [], [], seconds)[0]:
        return None
    return runner.stdout.readline()


def environment() -> dict[str, str]:
    """That of the tests, with the folders of the code in front."""
    root = HERE.parents[1]
    path = os.pathsep.join(map(str, (root, HERE, HERE.parent)))
    return os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1"}


def figures(found: list[Verdict]) -> str:
    """A table of counts by class."""
    rows = [f"{'class':38}{'cases':>7}{'survived':>10}{'right':>8}{'named':>12}"]
    for letter, (title, _) in [*CLASSES.items(), ("", ("all", ()))]:
        own = [v for v in found if v.id.startswith(letter + ":" if letter else "")]
        speaking = [v for v in own if v.named is not None]
        named = f"{sum(map(bool, (v.named for v in speaking)))}/{len(speaking)}"
        rows.append(
            f"{letter:2}{title:36}{len(own):7}{sum(v.survived for v in own):10}"
            f"{sum(v.right for v in own):8}{named:>12}"
        )
    return "\n".join(rows)


def endless(folder):
    while True:
        time.sleep(0.01)


def foreign(folder):
    raise ValueError("not one of ours")


def leaving(folder):
    (folder / "half").write_text("")
    raise ConfigError("no such option: --lc.")


def outside(folder):
    (folder.parent / "elsewhere").write_text("")


def refused(folder):
    raise ConfigError("no such option: --lc.")


# mistakes whose verdict is known, for the test of the judge; they count in no figure
MISTAKES = [
    case("a crash", lambda folder: os.abort(), Works),
    case("an exit", lambda folder: os._exit(0), Works),
    case("a hang", endless, Works, seconds=0.5),
    case("another exception", foreign, (Works, ConfigError)),
    case("a file that is left", leaving, ConfigError),
    case("a file elsewhere", outside, Works),
    case("another class", refused, MeshError),
    case("another word", refused, ConfigError, "--hex"),
    case("no warning", refused, Silent),
    case("a wrong value", lambda folder: require(False, "2 instead of 3"), Works),
    case("nothing wrong", refused, ConfigError, "--lc"),
]
