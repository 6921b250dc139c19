"""Run by test_fe_mpi.py under mpirun: what ranks do that wait, into one file."""

import ctypes
import json
import sys
import time
from importlib import import_module

import_module({"MPI": "mpi4py.MPI", "rom": "rom"}[sys.argv[1]])  # before all others

from mpi4py import MPI  # noqa: E402

import rom  # noqa: E402
from rom.fe.parallel import on_root  # noqa: E402

WORK_SECONDS = 0.6  # of rank 0, which the others wait for
COMM = MPI.COMM_WORLD


def work():
    start = time.process_time()
    while time.process_time() - start < WORK_SECONDS:
        pass


on_root(COMM, lambda: None)  # all are there
start = time.process_time()
on_root(COMM, work)
spent = COMM.gather(time.process_time() - start)
with open("/proc/self/maps") as maps:
    files = {line.split()[-1] for line in maps if "libopen-pal" in line}
told = [ctypes.CDLL(file).opal_progress_set_yield_when_idle(1) for file in files]
told = COMM.gather([bool(was & 0xFF) for was in told])
rom.fe.model("meshes/beam.geo", material=rom.Material(E=210e9, nu=0.3, rho=7850.0), degree=1)
if COMM.rank == 0:
    with open(sys.argv[2], "w") as file:
        json.dump({"spent": spent, "told": told}, file)
