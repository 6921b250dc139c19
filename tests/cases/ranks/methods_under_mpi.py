"""Run by test_fe_mpi.py under mpirun: a bar by every method, into one file."""

import json
import sys

from mpi4py import MPI

import numpy as np

import rom
from cases.solid import STEEL

BEAM = {"L": 0.4, "b": 0.05, "h": 0.03, "lc": 0.03}
STIFF = {"root": "rbe2", "tip": "rbe2"}
METHODS = {
    "Guyan": (rom.Guyan(), STIFF),
    "Craig-Bampton": (rom.CraigBampton(8), STIFF),
    "functions": (rom.CraigBampton(8), {"root": "polynomial:2", "tip": "fourier:2,0"}),
    "Rubin": (rom.Rubin(8), STIFF),
    "Herting": (rom.Herting(8), STIFF),
    "enhanced": (rom.EnhancedCraigBampton(8), STIFF),
    "moments": (rom.MomentMatching((0.0, 900.0), 2), STIFF),
    "balanced": (rom.BalancedTruncation(6, pool=20), STIFF),
    "loads": (rom.WithLoads(rom.CraigBampton(8)), STIFF),
    "free-free": (rom.FreeFree(8), STIFF),
    "assumed": (rom.AssumedModes(8, fixed={"root": "xyz rx", "tip": "yz"}), STIFF),
    "characteristic": (
        rom.Characteristic(rom.CraigBampton(8), 14), {"root": "full", "tip": "rbe2"}),
}  # fmt: skip

model = rom.fe.model("meshes/beam.geo", material=STEEL, parameters=BEAM)
found = {
    name: rom.reduce(model, method=method, interfaces=kinds, certify=False).frequencies()[6:12]
    for name, (method, kinds) in METHODS.items()
}
slides = {"root": "xyz", "tip": "yz"}
found["sliding"] = rom.modes(model, 6, fixed=slides).frequencies
springs = {"tip": [1e6, 2e6, 3e6]}
found["sprung"] = rom.modes(model, 6, fixed=("root",), springs=springs).frequencies
springs = {"tip": [1e9, 2e9, 3e9, 1e6, 2e6, 3e6]}  # stiff, so that round-off of K is small
found["on springs alone"] = rom.modes(model, 6, springs=springs).frequencies
free = rom.substructure(model, n_modes=8, interfaces=STIFF)
held = (("bar", "root"),)
for kind in ("macneal", "rubin", "dual"):
    found[kind] = rom.DualAssembly({"bar": free}, ()).frequencies(4, kind=kind, fixed=held)
if MPI.COMM_WORLD.rank == 0:
    with open(sys.argv[1], "w") as file:
        json.dump({name: np.asarray(f).tolist() for name, f in found.items()}, file)
