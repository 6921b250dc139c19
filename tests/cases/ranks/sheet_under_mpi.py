"""Run by test_assumed_strain.py under mpirun: the spectrum of a sheet whose sides are shared."""

import sys

from mpi4py import MPI

import numpy as np

from cases.sheets import distorted
from rom.components.assumed_strain import Metal, sheet, stiffness_by_sides

COMM = MPI.COMM_WORLD
body = sheet(*distorted((8, 6)))
K = stiffness_by_sides(body, Metal(210e9, 0.3, 7850.0), share=(COMM.rank, COMM.size)).toarray()
whole = np.zeros_like(K) if COMM.rank == 0 else None
COMM.Reduce(K, whole)
work = COMM.gather(np.count_nonzero(K))
if COMM.rank == 0:
    np.savez(sys.argv[1], spectrum=np.linalg.eigvalsh(whole), work=work)
