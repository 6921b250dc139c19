"""Set before anything numerical is loaded: one thread per process, and mpirun may run as root."""

import os
import signal

# a shell lets what it starts in the background ignore Ctrl-C, and processes pass that on
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ["OMP_NUM_THREADS"] = "1"
os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
os.environ.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")
# processes that wait for others leave the core to them
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
