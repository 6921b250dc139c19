"""What the doctor finds, and processes that try what may crash or compile what motions wait for.

What a process wrote before it died still counts.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from rom.process import child

TIME_LIMIT = 60.0  # [s]; a first import from a cold disk takes a few
LOOK_EVERY = 0.05  # [s] between looks at which process has ended
Answer = dict[str, Any]  # of JSON
ONE_THREAD = {"OMP_NUM_THREADS": "1"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at, a line of the report."""

    topic: str  # heading it stands under
    name: str
    value: str  # version, place or number found
    state: str = "ok"  # or "note": could be better; "missing": a part cannot be used; "broken"
    advice: str = ""  # what to type


@dataclass
class Probe:
    """A process that writes one JSON object with a name per line."""

    process: subprocess.Popen[bytes]  # noqa: TID251  a type
    ending: str = ""  # what happened before a good end

    def answer(self) -> dict[str, Answer]:
        """What the process found, by name."""
        done = child.finish(self.process, TIME_LIMIT)
        if done.overtime:
            self.ending = f"no end within {TIME_LIMIT:g} s"
        elif done.code:
            self.ending = _failure(done)
        lines = [json.loads(line) for line in done.out.splitlines() if line.startswith('{"name"')]
        return {line.pop("name"): line for line in lines}


def start(module: str, *arguments: str) -> Probe:
    """Run a module of rom beside this process."""
    return Probe(child.start(child.python(module, *arguments)))


def say(name: str, **found: object) -> None:
    """Write a line of what a process has found."""
    sys.stdout.write(json.dumps({"name": name, **found}) + "\n")
    sys.stdout.flush()


def compiled(module: str, cases: Sequence[str]) -> Iterator[Finding]:
    """Findings of the cases of a module as they end, on as many processes as there are cores."""
    cores, waiting = len(os.sched_getaffinity(0)), list(cases)
    running: dict[str, subprocess.Popen[bytes]] = {}  # noqa: TID251  a type
    while waiting or running:
        while waiting and len(running) < cores:
            case = waiting.pop(0)
            running[case] = child.start(child.python(module, case), variables=ONE_THREAD)
        time.sleep(LOOK_EVERY)
        for case in [name for name, process in running.items() if process.poll() is not None]:
            yield _finding(case, child.finish(running.pop(case)))


def _finding(case: str, ended: child.Ended) -> Finding:
    if ended.code:
        return Finding("compiled", case, _failure(ended), "broken")
    done = json.loads(ended.out.splitlines()[-1])
    value = f"{done['functions']} functions in {done['seconds']:.1f} s of the processor"
    return Finding("compiled", case, value if done["functions"] else "was compiled before")


def _failure(ended: child.Ended) -> str:
    return f"crashed ({ended.signal})" if ended.signal else f"failed: {ended.last}"
