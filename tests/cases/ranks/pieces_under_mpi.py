"""Run by test_pieces.py under mpirun: a beam is cut on one rank, and reduced by all of them."""

import sys

from mpi4py import MPI

import numpy as np

import rom

models = rom.fe.pieces(
    "meshes/beam.geo",
    n=2,
    axis=(1, 0, 0),
    material={"body": rom.Material(E=210e9, nu=0.3, rho=7850.0)},
    parameters={"hex": 1, "nx": 6, "ny": 1, "nz": 1},
    attachments=[rom.Attachment("tip", 0.5)],
)
pieces = rom.reduce_pieces(
    models,
    reference="root",
    method=rom.CraigBampton(n_modes=2),
    nonlinear=rom.Geometric(loads={"tip": (0, 0, 1e3, 0, 0, 0)}, n_modes=1, n_shapes=4),
    certify=False,
)
if MPI.COMM_WORLD.rank == 0:
    omega = [body.omega for body in pieces.bodies.values()]
    np.savez(sys.argv[1], a=omega[0], b=omega[1], mass=pieces.mass)
