"""Angles and displacements of joints along a motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.mbs.parts.joints import Joint, Row
from rom.model import Array


@dataclass(frozen=True)
class JointMotion:
    """The coordinates of one joint over time, zero as it was described; None what it has not.

    Attributes:
        t: (n_t,) times [s].
        angle: (n_t,) by which the second body has turned against the first about the axis,
            whole turns counted from the first instant [rad].
        angle_rate: (n_t,) its rate [rad/s].
        displacement: (n_t,) of the second body along the axis [m].
        displacement_rate: (n_t,) its rate [m/s].
    """

    t: Array
    angle: Array | None
    angle_rate: Array | None
    displacement: Array | None
    displacement_rate: Array | None


def joint_motion(t: Array, joint: Joint, one: Any, two: Any) -> JointMotion:
    """Measure a joint again, from the `rom.mbs.results.recomputed.Tracks` of its markers."""
    angle = (None, None) if joint.turn is None else angles(joint.turn, t, one, two)
    slide = joint.displacement
    displacement = (None, None) if slide is None else displacements(slide, one, two)
    return JointMotion(t, *angle, *displacement)


def angles(row: Row, t: Array, one: Any, two: Any) -> tuple[Array, Array]:
    """(n_t,) angle of b seen in the axes a and c, and its rate.

    Between two instants the angle changes by what the trapezoidal rule makes of the rates, to less
    than half a turn; that is how turns are counted.
    """
    a, c, b = one.axes @ row.a, one.axes @ row.c, two.axes @ row.b
    x, y = (a * b).sum(1), (c * b).sum(1)
    axis = np.cross(b, x[:, None] * c - y[:, None] * a) / (x * x + y * y)[:, None]
    rate = (axis * (two.twist[:, 3:] - one.twist[:, 3:])).sum(1)
    angle = np.arctan2(y, x) - row.offset
    order = np.argsort(t, kind="stable")
    expected = 0.5 * np.diff(t[order]) * (rate[order][1:] + rate[order][:-1])
    turns = np.cumsum(np.round((expected - np.diff(angle[order])) / (2 * np.pi)))
    angle[order[1:]] += 2 * np.pi * turns
    return angle, rate


def displacements(row: Row, one: Any, two: Any) -> tuple[Array, Array]:
    """(n_t,) distance along the axis a, which the first body carries, and its rate."""
    a, gap = one.axes @ row.a, two.position - one.position
    slide, turn = two.twist[:, :3] - one.twist[:, :3], np.cross(one.twist[:, 3:], a)
    return (a * gap).sum(1) - row.offset, (a * slide + turn * gap).sum(1)
