"""A small gear unit."""

from dataclasses import replace

import numpy as np

from rom.components.gear_mesh import GearPair, Mesh
from rom.components.journal_bearing import Groove, JournalBearing
from rom.components.transmission import Disc, Rotor, Shaft, Transmission

CELLS = (60, 4)


NODES = np.linspace(0, 0.2, 5)


def journal(direction, clearance=50e-6):
    """50 mm, 25 mm long, two grooves across the load."""
    grooves = [Groove(direction + side * np.pi / 2, np.radians(20)) for side in (1, -1)]
    return JournalBearing(0.05, 0.025, clearance, grooves, cells=CELLS)


def unit(torque=200.0, speed=100 * np.pi, helix=0.0, width=0.04, clearance=50e-6, **more):
    """26 to 157 teeth of module 4 on two equal shafts; torque of the pinion."""
    loose = GearPair((26, 157), 4e-3, width, helix)
    pair = replace(loose, centre_distance=loose.distance + 5e-5)
    n = np.array([np.sin(pair.alpha), np.cos(pair.alpha)])
    pushed = np.arctan2(-n[1], -n[0]), np.arctan2(-n[1], n[0])
    outer = 104e-3, 628e-3
    rotors = [
        Rotor(
            Shaft(NODES, 0.05, [Disc.of_ring(2, outer=d, inner=0.05, width=0.04)]), 2,
            {k: journal(a, clearance) for k in (0, 4)},
        )
        for d, a in zip(outer, pushed, strict=True)
    ]  # fmt: skip
    mesh = Mesh(pair, 15e9, damping=2e-6)
    return Transmission(*rotors, mesh, speed, torque * 157 / 26, 0.02, **more)
