"""Run by test_fe_curved.py under mpirun: a plate with a bore and its body into one file."""

import json
import sys

from mpi4py import MPI

import rom
from cases.solid import STEEL

SIZE = {"lc": 0.0104}  # 12 edges round the bore
model = rom.fe.model(sys.argv[1], material=STEEL, parameters=SIZE)
body = rom.reduce(model, method=rom.CraigBampton(8), interfaces={"bore": "rbe3", "end": "rbe2"},
                  stress=True, stiffening=True, certify=False)  # fmt: skip
bore = model.interfaces["bore"]
found = {
    "mass": model.mass(),
    "free": rom.modes(model, 10).frequencies[6:].tolist(),
    "reduced": body.frequencies()[6:12].tolist(),
    "area": float(bore.surface_mass.sum()),
    "height": float(bore.origin[2]),
    "triangles": len(model.surface.triangles),
}
if MPI.COMM_WORLD.rank == 0:
    with open(sys.argv[2], "w") as file:
        json.dump(found, file)
