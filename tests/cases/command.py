"""Running the command line as a user does, also under mpirun."""

import os
import subprocess
import sys

from cases.paths import ROOT
from rom.process.mpirun import mpirun


def environment(**more):
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    return os.environ | {"PYTHONPATH": path, "OMPI_MCA_mpi_yield_when_idle": "1"} | more


def python(*arguments, timeout=180, launcher=(), **options):
    """Finished process of Python, its texts captured."""
    command = [*launcher, sys.executable, *map(str, arguments)]
    options = {"env": environment(), "capture_output": True, "text": True, "check": False} | options
    return subprocess.run(command, timeout=timeout, **options)


def rom(*arguments, n=1, **options):
    """Finished process of ``rom …``, on n ranks."""
    return python("-m", "rom", *arguments, launcher=mpirun(n) if n > 1 else (), **options)
