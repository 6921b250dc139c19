"""What a process under mpirun is started with."""

import os

from cases.command import python
from cases.paths import PYTHONPATH, RANKS, ROOT
from rom.process.mpirun import mpirun

ENVIRONMENT = os.environ | {
    "PYTHONPATH": PYTHONPATH,
    "OMP_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}


def under_mpi(n, script, *arguments):
    """Finished process of a script of this folder on n ranks, its texts captured."""
    return python(
        RANKS / script, *arguments, launcher=mpirun(n), env=ENVIRONMENT, timeout=600, cwd=ROOT
    )
