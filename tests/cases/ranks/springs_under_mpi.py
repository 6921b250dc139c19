"""Run by test_mesh_springs.py under mpirun: a deck with springs, on each number of ranks."""

import sys

from mpi4py import MPI

import numpy as np

import rom

model = rom.fe.model(sys.argv[1], degree=1)
modes = rom.modes(model, 12)
body = rom.reduce(model, method=rom.CraigBampton(6), interfaces={"spc_1": "rbe2"})
if MPI.COMM_WORLD.rank == 0:
    free, held = modes.omega[6:], body.omega
    np.savez(sys.argv[2], free=free, held=held, ok=body.certificate.ok, springs=model.springs)
