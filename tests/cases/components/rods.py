"""Shapes of rods near others, and slopes along their increments."""

import numpy as np

from rom import rotation
from rom.components.cosserat import Shape

ALONG_X = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # section axes: y, z, x


def moved(shape, d):
    """A shape after increments, ordered plate, x_0, segment, x_1, ..."""
    rows = np.append(d, np.zeros(3)).reshape(-1, 6)
    pairs = zip(shape.p, rows[:, :3], strict=True)
    turned = [rotation.multiply(p, rotation.exp(phi)) for p, phi in pairs]
    return Shape(shape.x + rows[:-1, 3:], np.array(turned))


def slopes(function, n, step=1e-5):
    """Central differences along every increment, last axis."""
    unit = step * np.eye(n)
    return np.stack([(function(d) - function(-d)) / (2 * step) for d in unit], axis=-1)
