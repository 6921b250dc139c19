"""Run by test_fe_iterative.py under mpirun: a bar reduced without a factor, into one file."""

import sys

from mpi4py import MPI

import numpy as np

import rom

N_MODES = 6
bar = rom.fe.model(
    "meshes/beam.geo",
    material=rom.Material(E=210e9, nu=0.3, rho=7850.0),
    parameters={"L": 0.4, "b": 0.1, "h": 0.06, "lc": 0.06},
    solver=sys.argv[1],
)
body = rom.reduce(
    bar, method=rom.CraigBampton(N_MODES), interfaces={"root": "rbe2", "tip": "rbe3"}, certify=False
)
n = len(body.K) - N_MODES  # constraint modes stand first
found = {
    "free": body.frequencies()[6:],
    "springs": body.K[:n, :n],
    "modes": rom.modes(bar, 12).frequencies[6:],
    "held": rom.modes(bar, 6, fixed=("root",)).frequencies,
    "missed": body.provenance["stages"]["shapes"]["probability of a missed mode"],
}
if MPI.COMM_WORLD.rank == 0:
    np.savez(sys.argv[2], **found)
