"""What the doctor finds, and processes that try what may crash.

What a process wrote before it died still counts.
"""

import json
import subprocess
from dataclasses import dataclass
from typing import Any

from rom.process import child

TIME_LIMIT = 60.0  # [s]; a first import from a cold disk takes a few


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at, a line of the report.

    Attributes:
        topic: heading it stands under.
        name: what was looked at.
        value: version, place or number found.
        state: "ok"; "note": works, and could be better; "missing": a part of rom cannot be used;
            "broken": installed or found, and does not work.
        advice: what to type.
    """

    topic: str
    name: str
    value: str
    state: str = "ok"
    advice: str = ""


@dataclass
class Probe:
    """A process that writes one JSON object with a name per line.

    Attributes:
        ending: "" after a good end, else what happened.
    """

    process: subprocess.Popen[bytes]  # noqa: TID251  a type
    ending: str = ""

    def answer(self) -> dict[str, dict[str, Any]]:
        """What the process found, by name."""
        done = child.finish(self.process, TIME_LIMIT)
        if done.overtime:
            self.ending = f"no end within {TIME_LIMIT:g} s"
        elif done.code:
            self.ending = f"crashed ({done.signal})" if done.signal else f"failed: {done.last}"
        lines = [json.loads(line) for line in done.out.splitlines() if line.startswith('{"name"')]
        return {line.pop("name"): line for line in lines}


def start(module: str, *arguments: str) -> Probe:
    """Run a module of rom beside this process."""
    return Probe(child.start(child.python(module, *arguments)))
