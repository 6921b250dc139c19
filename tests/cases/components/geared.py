"""Pairs of wheels in mesh, for tests of teeth."""

import numpy as np

import rom
from rom import rotation

ORIGIN, Z = (0, 0, 0), (0, 0, 1)
SOLID = (1e-3, 1e-3, 2e-3)  # inertia of either wheel, about its axis last


def free_wheels(pair, *, turned=None, at=(ORIGIN, ORIGIN), inertia=SOLID, omega=(0, 0), **mesh):
    """Two free wheels in mesh, or pinion and rack, the whole turned; markers at places of both."""
    A = np.eye(3) if turned is None else rotation.matrix(turned)
    mech, ends = rom.Mechanism(gravity=ORIGIN), []
    for k, (name, x) in enumerate((("pinion", 0.0), ("gear", pair.distance))):
        pose = {"at": A @ (x, 0, 0), "orientation": turned, "omega": (0, 0, omega[k])}
        part = mech.add_rigid(name, mass=1.0, inertia=inertia, **pose)
        ends.append(part.marker(at[k]))
    mech.gear_mesh("mesh", *ends, axis=A @ Z, pair=pair, **mesh)
    return mech
