"""Run by test_fe_iterative.py under mpirun: a bar reduced by some solvers, into one file."""

import sys

from mpi4py import MPI

import numpy as np

import rom

N_MODES = 6
*SOLVERS, FILE = sys.argv[1:]


def found(solver):
    bar = rom.fe.model(
        "meshes/beam.geo",
        material=rom.Material(E=210e9, nu=0.3, rho=7850.0),
        parameters={"L": 0.4, "b": 0.1, "h": 0.06, "lc": 0.06},
        solver=solver,
    )
    ends, method = {"root": "rbe2", "tip": "rbe3"}, rom.CraigBampton(N_MODES)
    body = rom.reduce(bar, method=method, interfaces=ends, certify=False)
    n = len(body.K) - N_MODES  # constraint modes stand first
    shapes = body.provenance["stages"]["shapes"]
    return {
        "free": body.frequencies()[6:],
        "springs": body.K[:n, :n],
        "modes": rom.modes(bar, 12).frequencies[6:],
        "held": rom.modes(bar, 6, fixed=("root",)).frequencies,
        "missed": shapes.get("probability of a missed mode", 0.0),
    }


every = {f"{solver} {name}": x for solver in SOLVERS for name, x in found(solver).items()}
if MPI.COMM_WORLD.rank == 0:
    np.savez(FILE, **every)
