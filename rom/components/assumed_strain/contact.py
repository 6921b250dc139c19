"""Nodes against a rigid tool in implicit steps: penalty, and friction by return mapping.

Source:
    Wriggers, Computational Contact Mechanics, 2nd ed. (2006).
"""

from dataclasses import dataclass

import numpy as np

from rom.model import Array, Index

SHEAR_RATIO = 0.1  # stiffness along a face before a node slides, over that across


@dataclass(frozen=True, slots=True)
class Touch:
    """What a tool does to nodes.

    Attributes:
        forces: (n, 2) on the nodes [N].
        slip: (n,) elastic slip, which the friction holds [m].
        entries: nodes (k,) and their stiffness (k, 2, 2) [N/m].
    """

    forces: Array
    slip: Array
    entries: tuple[Index, Array]


def touch(
    x: Array, moved: Array, slip: Array, faces: Array, friction: float, stiff: Array
) -> Touch:
    """Forces and stiffness of a tool of faces (f, 7): corner, tangent, outer normal, length.

    Positions x (n, 2) [m] are seen from the tool, along which they ``moved`` (n, 2) in this step,
    with the elastic slip (n,) before it; ``stiff`` (n,) is the stiffness across a face [N/m].
    """
    gaps = np.einsum("nfa,fa->nf", x[:, None] - faces[:, :2], faces[:, 4:6])
    face, depth = gaps.argmax(axis=1), np.maximum(-gaps.max(axis=1), 0.0)
    along, normal, inside = faces[face, 2:4], faces[face, 4:6], depth > 0
    pressed, hold = stiff * depth, SHEAR_RATIO * stiff
    shear = -hold * np.where(inside, slip + (moved * along).sum(axis=1), 0.0)
    limit = np.zeros(len(x))
    limit[inside] = friction * pressed[inside]
    slides = np.abs(shear) >= limit
    shear[slides] = np.sign(shear[slides]) * limit[slides]
    forces = pressed[:, None] * normal + shear[:, None] * along
    i = np.flatnonzero(inside)
    n, s, K = normal[i], along[i], stiff[i, None, None]
    turn = np.where(slides[i], friction * np.sign(shear[i]), 0.0) if friction < np.inf else 0 * i
    A = K * (n + turn[:, None] * s)[:, :, None] * n[:, None, :]
    A = A + np.where(slides[i], 0.0, SHEAR_RATIO)[:, None, None] * K * s[:, :, None] * s[:, None, :]
    return Touch(forces, -shear / hold, (i, A))
