"""What a process under mpirun is started with."""

import os

from cases.paths import PYTHONPATH

ENVIRONMENT = os.environ | {
    "PYTHONPATH": PYTHONPATH,
    "OMP_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}
