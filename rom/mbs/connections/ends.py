"""How a joint connects two bodies: what it must know of both, and what it may not do to them."""

from dataclasses import dataclass

import numpy.typing as npt

from rom import rotation
from rom.arguments import number, unit_vector
from rom.errors import ConfigError, ModelError
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Joint, Triad, Whole, triad
from rom.model import Array

MOMENT_FREE = ("spherical", "distance")  # joints that bodies without static shapes may have


@dataclass(frozen=True, slots=True)
class Ends:
    """The two markers of a joint where the bodies were added."""

    name: str  # of the joint
    markers: tuple[Marker, Marker]  # both
    frames: tuple[Array, Array]  # (3, 3) axes of both bodies, as columns in the world
    gap: Array  # (3,) from the first marker to the second, world [m]

    def direction(self, what: str, axis: npt.ArrayLike) -> Array:
        """(3,) unit vector of an axis that the user gave."""
        return unit_vector(f"{what} of {self.name}", axis)

    def triad(self, axis: Array) -> Triad:
        """Axes with ``axis`` last, carried by both bodies."""
        return triad(axis, self.frames)


def ends_of(whole: Whole, name: str, m1: Marker, m2: Marker) -> Ends:
    """The ends of a new joint, whose name and markers are checked."""
    whole.check_new(name)
    whole.check_apart(name, m1, m2)
    A1, A2 = (rotation.matrix(whole.part(m.body).p) for m in (m1, m2))
    return Ends(name, (m1, m2), (A1, A2), whole.design_point(m2) - whole.design_point(m1))


def enter(whole: Whole, joint: Joint) -> None:
    """Let the mechanism have a joint, unless a body has no shapes for it, or spins beside it."""
    for marker in joint.markers:
        whole.part(marker.body).check_on_axis(joint.name, marker)
    for marker in joint.markers if joint.kind not in MOMENT_FREE else ():
        body = whole.part(marker.body).flexible
        if body is not None and not body.has_static_shapes:
            text = f"{joint.kind} joint {joint.name!r} transmits moments, and body {marker.body!r}"
            hint = "Reduce the body with CraigBampton or Rubin, which know the interfaces."
            raise ModelError(f"{text} has free-free modes only: it is too stiff.", hint=hint)
    whole.joints[joint.name] = joint


def not_zero(name: str, value: float) -> float:
    """A finite number that is not zero."""
    x = number(name, value)
    if x == 0.0:
        raise ConfigError(f"{name} = 0 would lock the joint instead of coupling it; give another.")
    return x
