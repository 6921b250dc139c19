"""How bodies are connected: joints, couplings of joints, and prescribed joint coordinates."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy.typing as npt

from rom import rotation
from rom.arguments import number, positive, typed, unit_vector
from rom.errors import ConfigError, ModelError
from rom.mbs.parts import joints
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.joints import Joint, Row
from rom.model import Array

TimeFunction = Callable[[float], Any]


@dataclass(frozen=True, slots=True)
class Drive:
    """A joint coordinate prescribed in time, with its rate and acceleration or None."""

    joint: str
    function: TimeFunction
    rate: TimeFunction | None
    acceleration: TimeFunction | None


@typed
class Connections:
    """The joints of a `rom.mbs.mechanism.Mechanism`."""

    joints: dict[str, Joint]
    drives: dict[str, Drive]
    part: Callable[[str], Part]
    design_point: Callable[[Marker], Array]
    _check_new: Callable[[str], None]
    _check_markers: Callable[..., None]

    def revolute(self, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
        """Hinge about ``axis`` (3,), world at the start; five constraints."""
        self._join(name, m1, m2, joints.revolute, axis=axis)

    def cylindrical(self, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
        """Rotation about and sliding along ``axis`` (3,), world at the start; four constraints."""
        self._join(name, m1, m2, joints.cylindrical, axis=axis)

    def prismatic(self, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
        """Sliding along ``axis`` (3,), world at the start; five constraints."""
        self._join(name, m1, m2, joints.prismatic, axis=axis)

    def spherical(self, name: str, m1: Marker, m2: Marker) -> None:
        """Ball joint; three constraints."""
        self._join(name, m1, m2, joints.spherical)

    def universal(
        self, name: str, m1: Marker, m2: Marker, *, axis1: npt.ArrayLike, axis2: npt.ArrayLike
    ) -> None:
        """Cardan joint: ``axis1`` on m1 stays perpendicular to ``axis2`` on m2; four constraints.

        Raises:
            ConfigError: if the axes are not perpendicular at the start.
        """
        self._join(name, m1, m2, joints.universal, axis1=axis1, axis2=axis2)

    def fixed(self, name: str, m1: Marker, m2: Marker) -> None:
        """Weld; six constraints."""
        self._join(name, m1, m2, joints.fixed)

    def planar(self, name: str, m1: Marker, m2: Marker, *, normal: npt.ArrayLike) -> None:
        """Sliding in a plane of ``normal`` (3,) through m1, turning about it; three constraints."""
        self._join(name, m1, m2, joints.planar, normal=normal)

    def screw(
        self, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike, pitch: float
    ) -> None:
        """Cylindrical joint that advances by ``pitch`` [m] per turn; five constraints.

        A positive pitch is a right-hand thread: a right-hand turn about ``axis`` advances along it.
        """
        kind = partial(joints.screw, pitch=_not_zero("pitch", pitch))
        self._join(name, m1, m2, kind, axis=axis)

    def point_on_line(self, name: str, m1: Marker, m2: Marker, *, axis: npt.ArrayLike) -> None:
        """The point m2 slides on a line along ``axis`` (3,) through m1; two constraints."""
        self._join(name, m1, m2, joints.point_on_line, axis=axis)

    def point_on_plane(self, name: str, m1: Marker, m2: Marker, *, normal: npt.ArrayLike) -> None:
        """The point m2 slides in the plane of ``normal`` (3,) through m1; one constraint."""
        self._join(name, m1, m2, joints.point_on_plane, normal=normal)

    def distance(self, name: str, m1: Marker, m2: Marker, *, length: float | None = None) -> None:
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
        self._join(name, m1, m2, partial(joints.distance, length=long))

    def rolling(
        self,
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
        self._join(name, m1, m2, kind, normal=normal, **({} if axis is None else {"axis": axis}))

    def gear(
        self,
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
        self._check_new(name)
        names, wanted = (joint1, joint2), (coordinate1, coordinate2)
        rows = tuple(self._coordinate(j, c, "gear") for j, c in zip(names, wanted, strict=True))
        if rows[0] is rows[1]:
            raise ConfigError(f"gear {name!r} couples joint {joint1!r} with itself.")
        first, second = self.joints[joint1], self.joints[joint2]
        ratio = _not_zero("ratio", ratio)
        self.joints[name] = joints.coupling(name, first, second, rows, ratio)

    def drive(
        self,
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
        self._check_new(name)
        self._joint_with_axis(joint, "drive")
        self.drives[name] = Drive(joint, function, rate, acceleration)

    def _join(
        self, name: str, m1: Marker, m2: Marker, kind: Callable[..., Joint], **axes: Any
    ) -> None:
        self._check_new(name)
        self._check_markers(name, m1, m2)
        if m1.body == m2.body:
            raise ConfigError(f"joint {name!r} connects body {m1.body!r} with itself.")
        A1, A2 = (rotation.matrix(self.part(m.body).p) for m in (m1, m2))
        gap = self.design_point(m2) - self.design_point(m1)
        directions = [unit_vector(f"{what} of {name}", axis) for what, axis in axes.items()]
        joint = kind(name, (m1, m2), (A1, A2), gap, *directions)
        self._refuse_free_free(joint)
        self.joints[name] = joint

    def _refuse_free_free(self, joint: Joint) -> None:
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

    def _joint_with_axis(self, joint: str, what: str) -> Joint:
        if joint not in self.joints:
            raise ConfigError(f"{what}: no joint {joint!r}; there are {sorted(self.joints)}.")
        if self.joints[joint].coordinate is None:
            raise ConfigError(
                f"{what}: joint {joint!r} is {self.joints[joint].kind}; only revolute, "
                "cylindrical, screw, planar, prismatic and point on line joints have a coordinate."
            )
        return self.joints[joint]

    def _coordinate(self, joint: str, which: str | None, what: str) -> Row:
        """The row of the coordinate "angle" or "displacement" of a joint; None for the first."""
        found = self._joint_with_axis(joint, what)
        rows = {None: found.coordinate, "angle": found.turn, "displacement": found.displacement}
        rows["way"] = found.displacement  # as it was called before
        if which not in rows:
            raise ConfigError(
                f"coordinate {which!r} of {joint!r}: it is 'angle' or 'displacement'."
            )
        row = rows[which]
        if row is None:
            raise ConfigError(f"joint {joint!r} is {found.kind}: it has no coordinate {which!r}.")
        return row


def _not_zero(name: str, value: float) -> float:
    x = number(name, value)
    if x == 0.0:
        raise ConfigError(f"{name} = 0: it would lock the joint instead of coupling it.")
    return x
