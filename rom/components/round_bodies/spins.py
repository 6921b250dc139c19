"""Round bodies that turn in a frame which does not, as elements: their gyroscopic forces."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.components.round_bodies.gyroscopic import (
    check_round,
    rigid_gyroscopic,
    spin_matrices,
)
from rom.mbs.elements.family import Family, Places, apart, from_outside, integers, on_joint
from rom.mbs.kernels.element_calls import residuals, tangents
from rom.mbs.kernels.markers import own_corner
from rom.mbs.kernels.tables import Array3, Index1, Table, table
from rom.mbs.parts.bodies import Part
from rom.model import Array


@dataclass(frozen=True, slots=True)
class Spin:
    """A body that turns; arrays as in `Spins`."""

    body: str
    gyroscopic: Array
    circulatory: Array


def spin_of(part: Part) -> tuple[Spin, Family]:
    """The gyroscopic forces of a body, and their family.

    Raises:
        ModelError: if it is not round about the axis of its spin.
    """
    speed = float(np.linalg.norm(part.spin))
    axis = part.spin / speed
    if part.flexible is None:
        inertia = np.trace(part.second) * np.eye(3) - part.second
        check_round(part.name, part.mass, part.first, inertia, axis)
        gyroscopic, circulatory = rigid_gyroscopic(inertia, axis), np.zeros((0, 0))
    else:
        gyroscopic, circulatory = spin_matrices(part.moving, axis)
    return Spin(part.name, speed * gyroscopic, speed * circulatory), SPINS_FAMILY


@table
class Spins(Table):
    """All bodies that turn.

    Attributes:
        body: (k,) which.
        gyroscopic: (k, 3 + R, 3 + R) forces on rotations and shapes per velocity of them.
        circulatory: (k, R, R) of damping on shapes per elastic coordinate.
    """

    body: Index1
    gyroscopic: Array3
    circulatory: Array3


def pack(spins: Mapping[str, Spin], places: Places) -> Spins:
    """The spins as arrays."""
    k, R = len(spins), places.R
    G, C = np.zeros((k, 3 + R, 3 + R)), np.zeros((k, R, R))
    for k, one in enumerate(spins.values()):
        r = len(one.circulatory)
        G[k, : 3 + r, : 3 + r], C[k, :r, :r] = one.gyroscopic, one.circulatory
    return Spins(integers(places.body[one.body] for one in spins.values()), G, C)


@residuals.of(Spins)
def spin_forces(s: Any, W: Any, spins: Any, q: Any, v: Any, _lam: Any) -> None:
    """Subtract the forces from W.residual; what turns the body drives those of damping."""
    for k in range(spins.body.size):
        b = spins.body[k]
        at, first, r = s.bodies.v_at[b] + 3, s.bodies.q_at[b] + 7, s.bodies.r[b]
        for i in range(3 + r):
            for j in range(3 + r):
                W.residual[at + i] -= spins.gyroscopic[k, i, j] * v[at + j]
        for i in range(r):
            force = 0.0
            for j in range(r):
                force += spins.circulatory[k, i, j] * q[first + j]
            W.residual[at + 3 + i] -= force
            W.power[1] += force * v[at + 3 + i]


@tangents.of(Spins)
def spin_tangents(s: Any, W: Any, spins: Any, _lam: Any, ck: Any, cc: Any) -> None:
    """Subtract ck times the derivative by coordinates from W.Kt, cc times that by velocities."""
    for k in range(spins.body.size):
        b = spins.body[k]
        (x, y), r = own_corner(s, b), s.bodies.r[b]
        for i in range(3 + r):
            for j in range(3 + r):
                W.S[x + 3 + i, y + 3 + j] -= cc * spins.gyroscopic[k, i, j]
        for i in range(r):
            for j in range(r):
                W.Kt[x + 6 + i, y + 6 + j] -= ck * spins.circulatory[k, i, j]


SPINS_FAMILY = Family(
    "spins", Spin, pack, spin_forces, spin_tangents, ends=on_joint, outside=from_outside,
    couples=apart, complete=True, potential=False,
)  # fmt: skip
