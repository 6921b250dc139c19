"""Stones in contact: boxes, and what stands on the ground."""

import numpy as np

from rom.components.masonry import Masonry, stone

G = 9.81
SOFT = {"E": 1e9, "nu": 0.2, "rho": 2000.0}
GROUND = np.array([[-10.0, -1.0], [10.0, -1.0], [10.0, 0.0], [-10.0, 0.0]])


def box(width=1.0, height=1.0, at=(0.0, 0.0)):
    return np.array([[0, 0], [width, 0], [width, height], [0, height]]) + np.asarray(at)


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def on_the_ground(*stones, friction=0.0, slope=0.0, **options):
    ground = stone(GROUND @ turned(slope).T, **SOFT)
    return Masonry((ground, *stones), (0,), 10 * SOFT["E"], friction, **options)
