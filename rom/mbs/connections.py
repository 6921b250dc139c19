"""How bodies are connected: joints, couplings of joints, and prescribed joint coordinates."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy.typing as npt

from rom import rotation
from rom.arguments import number, positive, unit_vector
from rom.errors import ConfigError, ModelError
from rom.mbs.parts import joints
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Joint, coordinate_of, joint_with_axis
from rom.mbs.parts.whole import Whole

TimeFunction = Callable[[float], Any]


@dataclass(frozen=True, slots=True)
class Drive:
    """A joint coordinate prescribed in time, with its rate and acceleration or None."""

    joint: str
    function: TimeFunction
    rate: TimeFunction | None
    acceleration: TimeFunction | None


def revolute(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
    """Hinge about ``axis`` (3,), world at the start; five constraints."""
    _join(self, name, m1, m2, joints.revolute, axis=axis)


def cylindrical(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
    """Rotation about and sliding along ``axis`` (3,), world at the start; four constraints."""
    _join(self, name, m1, m2, joints.cylindrical, axis=axis)


def prismatic(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
    """Sliding along ``axis`` (3,), world at the start; five constraints."""
    _join(self, name, m1, m2, joints.prismatic, axis=axis)


def spherical(self: Whole, name: str, m1: Marker, m2: Marker) -> None:
    """Ball joint; three constraints."""
    _join(self, name, m1, m2, joints.spherical)


def universal(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    axis1: npt.ArrayLike,
    axis2: npt.ArrayLike,
) -> None:
    """Cardan joint: ``axis1`` on m1 stays perpendicular to ``axis2`` on m2; four constraints.

    Raises:
        ConfigError: if the axes are not perpendicular at the start.
    """
    _join(self, name, m1, m2, joints.universal, axis1=axis1, axis2=axis2)


def fixed(self: Whole, name: str, m1: Marker, m2: Marker) -> None:
    """Weld; six constraints."""
    _join(self, name, m1, m2, joints.fixed)


def planar(self: Whole, name: str, m1: Marker, m2: Marker, *, normal: npt.ArrayLike) -> None:
    """Sliding in a plane of ``normal`` (3,) through m1, turning about it; three constraints."""
    _join(self, name, m1, m2, joints.planar, normal=normal)


def screw(
    self: Whole, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike, pitch: float
) -> None:
    """Cylindrical joint that advances by ``pitch`` [m] per turn; five constraints.

    A positive pitch is a right-hand thread: a right-hand turn about ``axis`` advances along it.
    """
    kind = partial(joints.screw, pitch=_not_zero("pitch", pitch))
    _join(self, name, m1, m2, kind, axis=axis)


def point_on_line(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
    """The point m2 slides on a line along ``axis`` (3,) through m1; two constraints."""
    _join(self, name, m1, m2, joints.point_on_line, axis=axis)


def point_on_plane(
    self: Whole, name: str, m1: Marker, m2: Marker, *, normal: npt.ArrayLike
) -> None:
    """The point m2 slides in the plane of ``normal`` (3,) through m1; one constraint."""
    _join(self, name, m1, m2, joints.point_on_plane, normal=normal)


def distance(
    self: Whole, name: str, m1: Marker, m2: Marker, *, length: float | None = None
) -> None:
    """Massless rod between two points; one constraint.

    Args:
        name: name of the joint.
        m1: one end.
        m2: other end.
        length: [m]; None for the distance at the start.

    Raises:
        ConfigError: if the points coincide.
    """
    long = None if length is None else positive("length", length)
    _join(self, name, m1, m2, partial(joints.distance, length=long))


def rolling(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    normal: npt.ArrayLike,
    radius: float,
    axis: npt.ArrayLike | None = None,
) -> None:
    """A ball or thin wheel touches a plane and rolls on it without slip.

    One constraint of position and two of velocity (not holonomic). Spin about the normal is
    free.

    Args:
        name: name of the joint.
        m1: point of the plane.
        m2: centre of the ball or wheel.
        normal: (3,) of the plane towards the centre, world at the start.
        radius: [m].
        axis: (3,) axis of a wheel, world at the start; None for a ball.

    Raises:
        ConfigError: if the wheel lies flat on the plane.
    """
    kind = partial(joints.rolling, radius=positive("radius", radius))
    _join(self, name, m1, m2, kind, normal=normal, **({} if axis is None else {"axis": axis}))


def gear(
    self: Whole,
    name: str,
    joint1: str,
    joint2: str,
    *,
    ratio: float,
    coordinate1: str | None = None,
    coordinate2: str | None = None,
) -> None:
    """Couple two joints: coordinate of the second = ``ratio`` times that of the first.

    Between two angles a pair of gears (negative ratio for outer teeth, seen along parallel
    axes), a chain or a belt; between an angle and a displacement a rack [m/rad]. A
    carrier that moves is the first body of both joints. Angles count over whole turns from the
    start.

    Args:
        name: name of the coupling; ``sol.reaction`` gives its load on the second body of
            ``joint2``.
        joint1: driving joint.
        joint2: driven joint.
        ratio: d(coordinate 2) / d(coordinate 1).
        coordinate1: "angle" or "displacement"; None for the only or the first one.
        coordinate2: likewise of ``joint2``.

    Raises:
        ConfigError: if a joint is unknown, has no such coordinate, or is named twice.
    """
    self.check_new(name)
    names, wanted = (joint1, joint2), (coordinate1, coordinate2)
    rows = tuple(
        coordinate_of(self.joints, j, c, "gear") for j, c in zip(names, wanted, strict=True)
    )
    if rows[0] is rows[1]:
        raise ConfigError(f"gear {name!r} couples joint {joint1!r} with itself.")
    first, second = self.joints[joint1], self.joints[joint2]
    ratio = _not_zero("ratio", ratio)
    self.joints[name] = joints.coupling(name, first, second, rows, ratio)


def drive(
    self: Whole,
    name: str,
    joint: str,
    function: TimeFunction,
    *,
    rate: TimeFunction | None = None,
    acceleration: TimeFunction | None = None,
) -> None:
    """Prescribe the angle of a revolute or cylindrical joint, or the way of a prismatic one.

    The coordinate is that of the second marker relative to the first, from the position in
    which the bodies were added. Missing derivatives are taken by finite differences.

    Raises:
        ConfigError: if the joint is unknown or has no coordinate to drive.
    """
    self.check_new(name)
    joint_with_axis(self.joints, joint, "drive")
    self.drives[name] = Drive(joint, function, rate, acceleration)


def _join(
    self: Whole, name: str, m1: Marker, m2: Marker, kind: Callable[..., Joint], **axes: Any
) -> None:
    self.check_new(name)
    self.check_markers(name, m1, m2)
    if m1.body == m2.body:
        raise ConfigError(f"joint {name!r} connects body {m1.body!r} with itself.")
    A1, A2 = (rotation.matrix(self.part(m.body).p) for m in (m1, m2))
    gap = self.design_point(m2) - self.design_point(m1)
    directions = [unit_vector(f"{what} of {name}", axis) for what, axis in axes.items()]
    joint = kind(name, (m1, m2), (A1, A2), gap, *directions)
    _refuse_free_free(self, joint)
    self.joints[name] = joint


def _refuse_free_free(self: Whole, joint: Joint) -> None:
    """Free-free modes carry no moment to an interface, so that no joint may transmit one."""
    for marker in joint.markers if joint.kind not in ("spherical", "distance") else ():
        body = self.part(marker.body).flexible
        if body is not None and not body.has_static_shapes:
            raise ModelError(
                f"{joint.kind} joint {joint.name!r} transmits moments, and body "
                f"{marker.body!r} has free-free modes only: it would be too stiff by tens of "
                "per cents and without stress at the joint.",
                hint="Reduce the body with CraigBampton or Rubin, which know the interfaces.",
            )


def _not_zero(name: str, value: float) -> float:
    x = number(name, value)
    if x == 0.0:
        raise ConfigError(f"{name} = 0: it would lock the joint instead of coupling it.")
    return x
