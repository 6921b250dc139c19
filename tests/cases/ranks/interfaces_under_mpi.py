"""Run by test_fe_mpi.py under mpirun: reductions by interfaces of one rank and of all ranks."""

import sys

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import locate_entities_boundary, meshtags

import rom
from cases.boxes import box
from cases.solid import STEEL
from rom.fe.elasticity import assemble

COMM = MPI.COMM_WORLD
KINDS = ("rbe2", "rbe3", "full", rom.Polynomial(2))
mesh, tags = box((1.0, 0.2, 0.13), (9, 2, 2), "tetrahedron")
side = np.sort(locate_entities_boundary(mesh, 2, lambda x: np.isclose(x[1], 0.0))).astype(np.int32)
tags = {"end": tags["x0"], "side": meshtags(mesh, 2, side, np.ones(side.size, dtype=np.int32))}
model = assemble(mesh, None, tags, material=STEEL, degree=1)
ops = model.operators
out = {}
for name in ("end", "side"):
    dofs = model.interfaces[name].dofs
    here = np.count_nonzero((dofs >= ops.first) & (dofs < ops.first + ops.n_local))
    out[f"ranks of {name}"] = np.count_nonzero(COMM.allgather(here))
    for kind in KINDS:
        body = rom.reduce(model, method=rom.CraigBampton(6), interfaces={name: kind}, certify=False)
        out[f"{name} {kind}"] = body.frequencies()[6:]
if COMM.rank == 0:
    np.savez(sys.argv[1], **out)
