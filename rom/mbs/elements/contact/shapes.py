"""Shapes that touch: planes, spheres, discs, cylinders, capsules, and surfaces of flexible bodies.

Each point of a surface carries the law of penetration times the area that belongs to it, so that a
finer mesh gives the same pressure: an elastic foundation. There ``law`` is an `Impact` whose
stiffness is per area, [N/m^exponent/m^2], as are stiffness and damping of its friction, which acts
at each point. The reaction acts on the body of m1, and ``solution.interface_loads`` has its sum
about m1. Cost grows with the number of points: choose by ``where`` the part that may touch.

Source:
    Johnson, Contact Mechanics (1985), section 4.3 (elastic foundation).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from rom import rotation
from rom.arguments import Direction, Length, NotNegative, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.contact import points
from rom.mbs.elements.contact.impact import Impact, checked_law
from rom.mbs.parts.bodies import Marker, Part, surface_place
from rom.mbs.parts.joints import Whole
from rom.model import Array

Where = Callable[[Array], Any] | str | None  # as rom.surface_load takes it
Axes = Sequence[Direction | None]  # of both shapes


def sphere_on_plane(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    law: Impact,
    *,
    normal: Direction,
    radius: Length,
) -> None:
    """Sphere about m2 against the plane through m1.

    Args:
        normal: (3,) of the plane towards the sphere, world at the start [1].
        radius: of the sphere [m].
    """
    _enter(self, name, points.PLANE, (m1, m2), law, (normal, None), (radius, 0.0))


def disc_on_plane(  # noqa: PLR0913  two surfaces and a law
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    law: Impact,
    *,
    normal: Direction,
    axis: Direction,
    radius: Length,
) -> None:
    """Rim of a thin disc about m2, which must not lie flat, against the plane through m1.

    Two of them make a cylinder.

    Args:
        normal: (3,) of the plane towards the disc, world at the start [1].
        axis: (3,) of the disc, world at the start [1].
        radius: of the disc [m].
    """
    _enter(self, name, points.DISC, (m1, m2), law, (normal, axis), (radius, 0.0))


def sphere_on_sphere(
    self: Whole, name: str, m1: Marker, m2: Marker, law: Impact, *, radius1: Length, radius2: Length
) -> None:
    """Spheres of radius1 about m1 and radius2 about m2 [m]."""
    _enter(self, name, points.SPHERE, (m1, m2), law, (None, None), (radius2, radius1))


def sphere_on_cylinder(  # noqa: PLR0913  two surfaces and a law
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    law: Impact,
    *,
    axis: Direction,
    radius1: Length,
    radius2: Length,
    inside: bool = False,
) -> None:
    """Sphere about m2 against an endless cylinder about m1, or its bore.

    A disc across a bore with its radius is a pin with clearance.

    Args:
        axis: (3,) of the cylinder, world at the start [1].
        radius1: of the cylinder [m].
        radius2: of the sphere [m].
        inside: the sphere is in the bore.

    Raises:
        ConfigError: for a sphere that does not fit into the bore.
    """
    if inside and radius2 >= radius1:
        text = f"contact {name!r}: the sphere of {radius2:g} m must be smaller than the bore of"
        raise ConfigError(f"{text} {radius1:g} m; leave inside out for a sphere outside.")
    kind, radii = points.BORE if inside else points.CYLINDER, (radius2, radius1)
    _enter(self, name, kind, (m1, m2), law, (axis, None), radii)


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
    """Round bars about m1 and m2, with half spheres as ends, which touch where they are nearest.

    A capsule without length is a sphere. While axes are parallel they touch in the middle of where
    they are side by side; as they turn through that the touching point runs to an end.

    Args:
        radius1: of the first one [m].
        radius2: of the second one [m].
        axis1: (3,) of the first one, world at the start [1]; None for a sphere.
        axis2: (3,) of the second one [1].
        length1: between the middles of its half spheres [m].
        length2: of the second one [m].

    Raises:
        ConfigError: for a length without an axis, or axes that cross at the start.
    """
    sizes = ((axis1, length1), (axis2, length2))
    for k, (axis, length) in enumerate(sizes, start=1):
        if length > 0.0 and axis is None:
            text = f"contact {name!r}: length{k} = {length:g} m without axis{k} is no bar"
            raise ConfigError(f"{text}; give a length and an axis, or neither for a sphere.")
    axes = [np.array([0.0, 0.0, 1.0]) if axis is None else axis for axis, _ in sizes]
    half = 0.5 * length2, 0.5 * length1
    self.check_markers(name, m1, m2)
    gap = self.design_point(m2) - self.design_point(m1)
    e, s = (unit_vector(f"axis of {name}", axis) for axis in axes)
    if not points.distance(gap, e, s, half[1], half[0]) > 0.0:
        text = f"contact {name!r}: the axes cross at the start; nothing tells the side on which the"
        raise ConfigError(f"{text} bodies touch. Move one of them away.")
    _enter(self, name, points.CAPSULE, (m1, m2), law, axes, (radius2, radius1), half)


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
        part: what `add_flexible` returned.
        normal: (3,) towards the body, world at the start [1].
        where: part of the surface, as in `rom.surface_load`.

    Raises:
        ModelError: if the body carries no surface.
    """
    _cover(self, name, points.PLANE, m1, part, law, (normal, 0.0, where))


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
        part: what `add_flexible` returned.
        radius: of the sphere [m].
        where: part of the surface, as in `rom.surface_load`.

    Raises:
        ModelError: if the body carries no surface.
    """
    _cover(self, name, points.SPHERE, m1, part, law, (None, radius, where))


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
        part: what `add_flexible` returned.
        axis: (3,) of the cylinder, world at the start [1].
        radius: of the cylinder [m].
        inside: the body is in the bore.
        where: part of the surface, as in `rom.surface_load`.

    Raises:
        ModelError: if the body carries no surface.
    """
    kind = points.BORE if inside else points.CYLINDER
    _cover(self, name, kind, m1, part, law, (axis, radius, where))


def _cover(
    self: Whole,
    name: str,
    kind: int,
    m1: Marker,
    part: Part,
    law: Impact,
    given: tuple[Direction | None, float, Where],
) -> None:
    """Put a contact on every point of the surface that has area."""
    axis, radius, where = given
    self.check_new(name)
    part = self.part(str(getattr(part, "name", part)))
    if part.flexible is None:
        text = f"contact {name!r}: body {part.name!r} is rigid, it has no surface"
        raise ConfigError(f"{text}; add it by add_flexible, or take a sphere_contact.")
    law = checked_law(name, law, part, self.part(m1.body))
    e, areas = _carried(self, name, m1, axis), part.flexible.surface_areas(where)
    self.check_apart(name, m1, Marker(part.name, surface_place(0)))
    for k in np.flatnonzero(areas):
        area, spring = float(areas[k]), law.tangential_stiffness
        own = replace(
            law,
            restitution=None,
            impact_speed=None,
            stiffness=law.stiffness * area,
            tangential_stiffness=None if spring is None else spring * area,
            tangential_damping=law.tangential_damping * area,
        )
        marker = Marker(part.name, surface_place(int(k)))
        contact = points.Contact(kind, m1, marker, e, np.zeros(3), (0.0, radius), own)
        self.add(f"{name} {k}", contact, points.CONTACTS_FAMILY)


def _enter(  # noqa: PLR0913  what the record holds
    self: Whole,
    name: str,
    kind: int,
    markers: tuple[Marker, Marker],
    law: Impact,
    axes: Axes,
    radius: tuple[float, float],
    half: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Add a contact whose axes are given in the world at the start; None where it has none."""
    self.check_apart(name, *markers)
    e, s = (_carried(self, name, *side) for side in zip(markers, axes, strict=True))
    law = checked_law(name, law, *(self.part(marker.body) for marker in markers))
    self.add(name, points.Contact(kind, *markers, e, s, radius, law, half), points.CONTACTS_FAMILY)


def _carried(self: Whole, name: str, marker: Marker, axis: Direction | None) -> Array:
    """(3,) direction of an axis in the axes of the body of a marker; zeros for none."""
    if axis is None:
        return np.zeros(3)
    return rotation.matrix(self.part(marker.body).p).T @ unit_vector(f"axis of {name}", axis)
