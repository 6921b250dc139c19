"""Running the command line as a user does, also under mpirun."""

import os
import subprocess
import sys
import time
from pathlib import Path

from cases.paths import ROOT
from rom.process.mpirun import mpirun


def environment(**more):
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    return os.environ | {"PYTHONPATH": path, "OMPI_MCA_mpi_yield_when_idle": "1"} | more


def ran(*command, timeout=180, **options):
    """Finished process, its texts captured."""
    options = {"capture_output": True, "text": True, "check": False} | options
    return subprocess.run([*map(str, command)], timeout=timeout, **options)


def python(*arguments, launcher=(), **options):
    """The same of Python, which finds this tree."""
    return ran(*launcher, sys.executable, *arguments, **{"env": environment()} | options)


def rom(*arguments, n=1, **options):
    """Finished process of ``rom …``, on n ranks."""
    return python("-m", "rom", *arguments, launcher=mpirun(n) if n > 1 else (), **options)


def wait_until(true, seconds=20):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)


def alive(pid):
    """Whether a process runs; one that only waits to be collected does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False
