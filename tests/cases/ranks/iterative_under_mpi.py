"""Run by test_fe_iterative.py under mpirun: a bar reduced by some solvers, into one file."""

import sys

from mpi4py import MPI

import numpy as np

import rom

N_MODES = 6
found, (*solvers, file) = {}, sys.argv[1:]
for solver in solvers:
    sizes = {"L": 0.4, "b": 0.1, "h": 0.06, "lc": 0.06}
    steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
    bar = rom.fe.model("meshes/beam.geo", material=steel, parameters=sizes, solver=solver)
    ends, method = {"root": "rbe2", "tip": "rbe3"}, rom.CraigBampton(N_MODES)
    body = rom.reduce(bar, method=method, interfaces=ends, certify=False)
    n = len(body.K) - N_MODES  # constraint modes stand first
    found |= {
        f"{solver} free": body.frequencies()[6:],
        f"{solver} springs": body.K[:n, :n],
        f"{solver} modes": rom.modes(bar, 12).frequencies[6:],
        f"{solver} held": rom.modes(bar, 6, fixed=("root",)).frequencies,
    }
    chance = body.provenance["stages"]["shapes"].get("probability of a missed mode", 0.0)
    found[f"{solver} missed"] = chance
if MPI.COMM_WORLD.rank == 0:
    np.savez(file, **found)
