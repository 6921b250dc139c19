"""What a process under mpirun is started with."""

import os

from cases.command import python
from cases.paths import PYTHONPATH, ROOT
from rom.process.mpirun import mpirun

ENVIRONMENT = os.environ | {
    "PYTHONPATH": PYTHONPATH,
    "OMP_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}


def on_ranks(n, *words, **options):
    """A finished process of Python on n ranks, its texts captured."""
    options = {"env": ENVIRONMENT, "cwd": ROOT, "timeout": 600} | options
    return python(*words, launcher=mpirun(n), **options)
