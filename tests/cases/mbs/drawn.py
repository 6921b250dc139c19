"""Things to draw: a bar that swings, a square that is squeezed; the volume of a shape."""

from dataclasses import replace

import numpy as np

import rom
from cases.mbs.mechanisms import lattice, lattice_body
from rom import view
from rom.body.flexible import Surface


def lattice_bar():
    """A lattice bar along x with a surface of its nodes, free, five sections."""
    data = lattice(stiffness=4e5)
    body = lattice_body(data)
    x = data[0]
    corners = [(3 * s + a, 3 * s + (a + 1) % 3) for s in range(4) for a in range(3)]
    triangles = [(i, j, i + 3) for i, j in corners] + [(i + 3, j, j + 3) for i, j in corners]
    shape = np.vstack([body.markers[f"n{i}"].translation for i in range(len(x))])
    return replace(body, surface=Surface(x, np.array(triangles), shape))


def swinging(bar):
    """The bar, turning with a ball beside it: a mechanism and its motion."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("bar", bar, omega=(0, 0, 30.0))
    mech.add_rigid("ball", mass=1.0, inertia=(1e-2,) * 3, at=(0, 0.6, 0))
    mech.spherical("tie", mech.ground.marker((0, 0, 0.15)), part.marker("n7"))
    return mech, rom.simulate(mech, t_end=0.1, dt=1e-3, assemble=True)


def squeezed(amount):
    """Two triangles of a unit square made narrower, coloured by the amount."""
    points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    now = points * (1 - amount, 1 + amount)
    return view.Shape("square", now, triangles, points, np.array([amount, 0.0]), "strain")


def volume(shape):
    """Inside a closed surface of points (n, 3) and triangles (m, 3) that face outwards."""
    a, b, c = np.moveaxis(shape[0][shape[1]], 1, 0)
    return np.einsum("ti,ti->", a, np.cross(b, c)) / 6
