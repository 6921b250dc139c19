"""Processes that try things which may crash; what they wrote before they died still counts."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from signal import Signals
from typing import Any

PATIENCE = 60.0  # seconds; a first import from a cold disk takes a few
LAUNCHER = ("OMPI_", "PMIX_", "PMI_")  # a child that has these believes mpirun started it


@dataclass
class Probe:
    """A process that writes one JSON object with a name per line.

    Attributes:
        ending: "" after a good end, else what happened.
    """

    process: subprocess.Popen[str]
    ending: str = ""

    def answer(self) -> dict[str, dict[str, Any]]:
        """What the process found, by name."""
        try:
            out, err = self.process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            out, err = self.process.communicate()
            self.ending = f"no end within {PATIENCE:g} s"
        code = self.process.returncode
        if code and not self.ending:
            last = err.strip().splitlines()[-1:] or [""]
            self.ending = f"crashed ({Signals(-code).name})" if code < 0 else f"failed: {last[0]}"
        lines = [json.loads(line) for line in out.splitlines() if line.startswith('{"name"')]
        return {line.pop("name"): line for line in lines}


def start(module: str, *arguments: str) -> Probe:
    """Run a module of rom beside this process."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(LAUNCHER)}
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join(filter(None, (root, kept.get("PYTHONPATH", ""))))
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        env=kept | {"PYTHONPATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    return Probe(process)
