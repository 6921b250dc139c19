"""Contact of capsules: round bars with ends that are half spheres."""

from typing import Annotated

import numpy as np

from rom.arguments import Direction, Length, NotNegative, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.contact.impact import Impact
from rom.mbs.elements.contact.points import CAPSULE, enter_contact
from rom.mbs.elements.contact.segments import distance
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.whole import Whole


def capsule_on_capsule(  # noqa: PLR0913  two bodies and a law
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    law: Impact,
    *,
    radius1: Length,
    radius2: Length,
    axis1: Direction | None = None,
    axis2: Direction | None = None,
    length1: Annotated[float, NotNegative("m")] = 0.0,
    length2: Annotated[float, NotNegative("m")] = 0.0,
) -> None:
    """Round bars with ends that are half spheres, which touch where they are nearest.

    A capsule without length is a sphere. While axes are parallel they touch in the middle of where
    they are side by side; as they turn through that the touching point runs to an end.

    Args:
        name: name of the contact.
        m1: middle of the first one.
        m2: middle of the second one.
        law: force of the penetration.
        radius1: of the first one [m].
        radius2: of the second one [m].
        axis1: (3,) of the first one, world at the start [1]; None for a sphere.
        axis2: (3,) of the second one [1].
        length1: between the middles of its half spheres [m].
        length2: of the second one [m].

    Raises:
        ConfigError: for a length without an axis or below zero, axes that cross at the start, a
            name in use, an unknown marker, one body twice, or a law that is no `rom.mbs.Impact`.
    """
    sizes = ((axis1, length1), (axis2, length2))
    for k, (axis, length) in enumerate(sizes, start=1):
        if length > 0.0 and axis is None:
            raise ConfigError(
                f"contact {name!r}: length{k} = {length:g} m without axis{k} is no bar.",
                hint="Give a positive length and an axis, or neither for a sphere.",
            )
    axes = [np.array([0.0, 0.0, 1.0]) if axis is None else axis for axis, _ in sizes]
    half = 0.5 * length2, 0.5 * length1
    self.check_markers(name, m1, m2)
    gap = self.design_point(m2) - self.design_point(m1)
    e, s = (unit_vector(f"axis of {name}", axis) for axis in axes)
    if not distance(gap, e, s, half[1], half[0]) > 0.0:
        raise ConfigError(f"contact {name!r}: the axes cross at the start; nothing tells the side "
                          "on which the bodies touch.", hint="Move one of them away.")  # fmt: skip
    enter_contact(self, name, CAPSULE, (m1, m2), law, axes, (radius2, radius1), half)
