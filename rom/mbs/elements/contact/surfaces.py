"""The surface of a flexible body against a plane, sphere or cylinder: an elastic foundation.

Each point of the surface carries the law of penetration times the area that belongs to it, so
that a finer mesh gives the same pressure. ``law`` is an `Impact` whose stiffness is per area,
[N/m^exponent/m^2], as are stiffness and damping of its friction, which acts at each point. The
reaction acts on the body of m1, and ``solution.interface_loads`` has its sum about m1. Cost grows
with the number of points: choose by ``where`` the part of the surface that may touch.

Source:
    Johnson, Contact Mechanics (1985), section 4.3 (elastic foundation).
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rom import rotation
from rom.arguments import Direction, Length, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.contact.impact import Impact, checked_law
from rom.mbs.elements.contact.points import BORE, CONTACTS_FAMILY, CYLINDER, PLANE, SPHERE, Contact
from rom.mbs.parts.bodies import Marker, Part, surface_place
from rom.mbs.parts.whole import Whole
from rom.model import Array

Where = Callable[[Array], Any] | str | None  # as rom.surface_load takes it


def surface_on_plane(
    self: Whole,
    name: str,
    m1: Marker,
    part: Part,
    law: Impact,
    *,
    normal: Direction,
    where: Where = None,
) -> None:
    """Surface of a flexible body against the plane through m1.

    Args:
        name: name of the contact.
        m1: point of the plane.
        part: what `add_flexible` returned, with a surface.
        law: per area.
        normal: (3,) towards the body, world at the start [1].
        where: part of the surface, as in `rom.surface_load`.

    Raises:
        ConfigError: for a wrong argument.
        ModelError: if the body carries no surface.
    """
    _cover(self, name, PLANE, m1, part, (law, normal, 0.0, where))


def surface_on_sphere(
    self: Whole,
    name: str,
    m1: Marker,
    part: Part,
    law: Impact,
    *,
    radius: Length,
    where: Where = None,
) -> None:
    """Surface of a flexible body against a sphere about m1.

    Args:
        name: name of the contact.
        m1: centre of the sphere.
        part: what `add_flexible` returned, with a surface.
        law: per area.
        radius: of the sphere [m].
        where: part of the surface, as in `rom.surface_load`.

    Raises:
        ConfigError: for a wrong argument.
        ModelError: if the body carries no surface.
    """
    _cover(self, name, SPHERE, m1, part, (law, None, radius, where))


def surface_on_cylinder(  # noqa: PLR0913  two surfaces and a law
    self: Whole,
    name: str,
    m1: Marker,
    part: Part,
    law: Impact,
    *,
    axis: Direction,
    radius: Length,
    inside: bool = False,
    where: Where = None,
) -> None:
    """Surface of a flexible body against an endless cylinder about m1, or inside its bore.

    Args:
        name: name of the contact.
        m1: point of the axis.
        part: what `add_flexible` returned, with a surface.
        law: per area.
        axis: (3,) of the cylinder, world at the start [1].
        radius: of the cylinder [m].
        inside: the body is in the bore.
        where: part of the surface, as in `rom.surface_load`.

    Raises:
        ConfigError: for a wrong argument.
        ModelError: if the body carries no surface.
    """
    kind = BORE if inside else CYLINDER
    _cover(self, name, kind, m1, part, (law, axis, radius, where))


def _cover(
    self: Whole, name: str, kind: int, m1: Marker, part: Part, given: tuple[Any, ...]
) -> None:
    """Put a contact on every point of the surface that has area."""
    law, axis, radius, where = given
    self.check_new(name)
    part = self.part(str(getattr(part, "name", part)))
    if part.flexible is None:
        raise ConfigError(
            f"contact {name!r}: body {part.name!r} is rigid, it has no surface.",
            hint="Add it by add_flexible, or give markers and a sphere_contact.",
        )
    law, e = checked_law(name, law, part, self.part(m1.body)), np.zeros(3)
    if axis is not None:
        world = unit_vector(f"axis of {name}", axis)
        e = rotation.matrix(self.part(m1.body).p).T @ world
    areas, spring = part.flexible.surface_areas(where), law.tangential_stiffness
    self.check_apart(name, m1, Marker(part.name, surface_place(0)))
    for k in np.flatnonzero(areas):
        own = Impact(
            stiffness=float(law.stiffness * areas[k]),
            exponent=law.exponent,
            damping=law.damping,
            mu=law.mu,
            transition_speed=law.transition_speed,
            tangential_stiffness=None if spring is None else float(spring * areas[k]),
            tangential_damping=float(law.tangential_damping * areas[k]),
        )
        marker = Marker(part.name, surface_place(int(k)))
        key = f"{name} {k}"
        contact = Contact(kind, m1, marker, e, np.zeros(3), (0.0, radius), own)
        self.add(key, contact, CONTACTS_FAMILY)
