"""Run by test_fe_substructured.py: a beam whose substructures share the factor of their border."""

import sys
from itertools import count

from mpi4py import MPI

import numpy as np

import rom
from cases.ranks.substructured_under_mpi import border
from cases.solid import STEEL
from rom.fe.operators.substructures import shared

COMM = MPI.COMM_WORLD
factors = count()


class Counted(shared.Border):
    def factor(self, complement):
        next(factors)
        return super().factor(complement)


shared.Border, shared.MAX_BORDER_RATIO = Counted, np.inf
sizes = {"L": 1.0, "b": 0.11, "h": 0.07, "lc": 0.07}
model = rom.fe.model("meshes/beam.geo", material=STEEL, parameters=sizes, solver="direct")
with border("shared"):
    body = rom.reduce(
        model,
        method=rom.CraigBampton(n_modes=6),
        interfaces={"root": "rbe2", "tip": "rbe3"},
        reference="root",
        certify=False,
    )
    held = rom.modes(model, 3, fixed=("root",))
dofs = model.interfaces["tip"].dofs
out = {"K": body.K, "M": body.M, "omega": body.omega, "surface": body.surface.shape}
out |= {"full": held.frequencies, "modes": model.operators.rows(held.shapes, dofs)}
n_factors = next(factors)
if COMM.rank == 0:
    np.savez(sys.argv[1], factors=n_factors, **out)
