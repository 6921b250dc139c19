"""Joints whose bodies share a surface: Reuleaux's lower pairs, and the weld."""

from typing import Annotated

import numpy as np

from rom.arguments import Direction, Number
from rom.mbs.connections.ends import Ends, ends_of, enter, not_zero
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import NO_VECTOR, Joint, Row, Triad, Whole, coincidence, coupling
from rom.model import Array

FULL_TURN = 2 * np.pi


def revolute(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: Direction) -> None:
    """Hinge about an axis; five constraints; its angle is the rotation of m2 against m1.

    Args:
        axis: (3,) direction, world at the start [1].

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
        >>> ends = {"pin": (-0.5, 0, 0)}
        >>> bob = mech.add_rigid("bob", mass=2.0, inertia=(1e-3,) * 3, at=(0.5, 0, 0), markers=ends)
        >>> mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bob.marker("pin"), axis=(0, 1, 0))
        >>> len(mech.joints["hinge"].rows)
        5
    """
    ends = ends_of(self, name, m1, m2)
    t = ends.triad(ends.direction("axis", axis))
    rows, angle = (*coincidence(), t.normal(0, 2), t.normal(1, 2)), t.angle()
    enter(self, Joint(name, "revolute", ends.markers, rows, angle, angle))


def cylindrical(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: Direction) -> None:
    """Rotation about and sliding along an axis; four constraints.

    Args:
        axis: (3,) direction, world at the start [1].
    """
    ends = ends_of(self, name, m1, m2)
    t, rows, displacement = coaxial(ends, ends.direction("axis", axis))
    angle = t.angle()
    enter(self, Joint(name, "cylindrical", ends.markers, rows, angle, angle, displacement))


def coaxial(ends: Ends, axis: Array) -> tuple[Triad, tuple[Row, ...], Row]:
    """Axes with one in common, on which the second point lies; rows of that, and way along it."""
    t = ends.triad(axis)
    rows = (t.along(0, NO_VECTOR), t.along(1, NO_VECTOR), t.normal(0, 2), t.normal(1, 2))
    return t, rows, t.along(2, ends.frames[0].T @ ends.gap)


def screw(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    axis: Direction,
    pitch: Annotated[float, Number("m")],
) -> None:
    """Cylindrical joint that advances as it turns; five constraints.

    A positive pitch is a right-hand thread: a right-hand turn about the axis advances along it.

    Args:
        axis: (3,) direction, world at the start [1].
        pitch: advance per turn [m].

    Raises:
        ConfigError: for a pitch of zero.
    """
    pitch = not_zero("pitch", pitch)
    ends = ends_of(self, name, m1, m2)
    t, rows, displacement = coaxial(ends, ends.direction("axis", axis))
    angle = t.angle()
    rows = (*rows, coupling((displacement, 1.0), (angle, -pitch / FULL_TURN)))
    enter(self, Joint(name, "screw", ends.markers, rows, angle, angle, displacement))


def prismatic(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: Direction) -> None:
    """Sliding along an axis; five constraints.

    Args:
        axis: (3,) direction, world at the start [1].
    """
    ends = ends_of(self, name, m1, m2)
    t, rows, displacement = coaxial(ends, ends.direction("axis", axis))
    rows = (*rows, t.normal(0, 1))
    enter(self, Joint(name, "prismatic", ends.markers, rows, displacement, None, displacement))


def spherical(self: Whole, name: str, m1: Marker, m2: Marker) -> None:
    """Ball joint; three constraints."""
    enter(self, Joint(name, "spherical", ends_of(self, name, m1, m2).markers, coincidence()))


def planar(self: Whole, name: str, m1: Marker, m2: Marker, *, normal: Direction) -> None:
    """Sliding of m2 in a plane through m1, turning about its normal; three constraints.

    Args:
        normal: (3,) of the plane, world at the start [1].
    """
    ends = ends_of(self, name, m1, m2)
    t = ends.triad(ends.direction("normal", normal))
    rows, angle = (t.along(2, NO_VECTOR), t.normal(0, 2), t.normal(1, 2)), t.angle()
    enter(self, Joint(name, "planar", ends.markers, rows, angle, angle))


def fixed(self: Whole, name: str, m1: Marker, m2: Marker) -> None:
    """Weld; six constraints.

    Example:
        >>> mech = rom.Mechanism()
        >>> beam = mech.add_flexible("beam", rom.load("beam.rom.npz"))
        >>> mech.fixed("wall", mech.ground.marker((0, 0.025, 0.015)), beam.marker("root"))
        >>> len(mech.joints["wall"].rows)
        6
    """
    ends = ends_of(self, name, m1, m2)
    t = ends.triad(np.array([0.0, 0.0, 1.0]))
    rows = (*coincidence(), t.normal(0, 1), t.normal(1, 2), t.normal(2, 0))
    enter(self, Joint(name, "fixed", ends.markers, rows))
