"""The program that starts ranks; those of another MPI than Python loads would never meet."""

import re
import shutil
import sys
from functools import cache
from pathlib import Path

from rom.errors import ResourceError
from rom.process.child import Limits, run

PROGRAM_NAME = "mpirun"
OPEN_MPI, MPICH_NAME = "Open MPI", "MPICH"
VERSIONS = (  # what they say of themselves
    (OPEN_MPI, re.compile(r"\(Open MPI\) (\S+)")),
    (MPICH_NAME, re.compile(r"HYDRA build details:\s+Version:\s+(\S+)")),
)
TIME_LIMIT = 20.0  # [s] for saying a version


def found() -> str:
    """Path of the launcher beside this Python, where pip and conda put it, or of the system.

    Empty where there is none.
    """
    beside = shutil.which(PROGRAM_NAME, path=str(Path(sys.executable).parent))
    return beside or shutil.which(PROGRAM_NAME) or ""


@cache
def version(program: str) -> str:
    """Which MPI a launcher is of, e.g. "Open MPI 4.1.4"; empty if it does not say so."""
    try:
        ended = run([program, "--version"], limits=Limits(seconds=TIME_LIMIT))
    except OSError:
        return ""
    output = ended.out
    named = ((name, pattern.search(output)) for name, pattern in VERSIONS)
    return next((f"{name} {match[1]}" for name, match in named if match), "")


def mpirun(n: int) -> list[str]:
    """What stands before a command that runs as n processes, also on fewer cores."""
    program = found()
    if not program:
        raise ResourceError(
            f"{PROGRAM_NAME} is not installed.", hint="`rom doctor` says what to type."
        )
    crowded = ["--oversubscribe"] if version(program).startswith(OPEN_MPI) else []
    return [program, *crowded, "-n", str(n)]
