"""Contact of spheres, discs and capsules, planes and cylinders, with damping and friction.

All functions of one contact take real or complex numbers: the tangents are imaginary parts after
an imaginary step, exact to round-off.

Source:
    Hunt, Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl.
    Mech. 42 (1975) 440. Complex step: Squire, Trapp, SIAM Review 40 (1998) 110.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom import rotation
from rom.arguments import Direction, Length, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.contact.bristles import (
    N_REMEMBERED,
    STORED,
    ends_of_spring,
    forget_spring,
    keep_spring,
    spring_and_slider,
)
from rom.mbs.elements.contact.impact import Impact, checked_law
from rom.mbs.elements.contact.segments import across_of
from rom.mbs.elements.family import Family, Hooks, Places, integers, rows_of
from rom.mbs.kernels.algebra import add, cross, dot, row, scale, sub, turn, unit_twist
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.whole import Whole
from rom.model import Array

# kinds of contacts
PLANE, SPHERE, CYLINDER, BORE, DISC, CAPSULE = range(6)
COMPLEX_STEP = 1e-30


@dataclass(frozen=True, slots=True)
class Contact:
    """A sphere, disc or capsule on j against something on i; numbers as in `Contacts`."""

    kind: int
    i: Marker
    j: Marker
    e: Array
    s: Array
    radius: tuple[float, float]
    law: Impact
    half: tuple[float, float] = (0.0, 0.0)


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
        name: name of the contact.
        m1: point of the plane.
        m2: centre of the sphere.
        law: force of the penetration.
        normal: (3,) of the plane towards the sphere, world at the start [1].
        radius: of the sphere [m].

    Raises:
        ConfigError: for a name in use, an unknown marker, one body twice, a law that is no
            `rom.mbs.Impact`, or no direction.
    """
    enter_contact(self, name, PLANE, (m1, m2), law, (normal, None), (radius, 0.0))


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
    """Rim of a thin disc about m2 against the plane through m1; two make a cylinder.

    Args:
        name: name of the contact.
        m1: point of the plane.
        m2: centre of the disc, which must not lie flat.
        law: force of the penetration.
        normal: (3,) of the plane towards the disc, world at the start [1].
        axis: (3,) of the disc, world at the start [1].
        radius: of the disc [m].

    Raises:
        ConfigError: for a name in use, an unknown marker, one body twice, a law that is no
            `rom.mbs.Impact`, or no direction.
    """
    enter_contact(self, name, DISC, (m1, m2), law, (normal, axis), (radius, 0.0))


def sphere_on_sphere(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    law: Impact,
    *,
    radius1: Length,
    radius2: Length,
) -> None:
    """Spheres of radius1 about m1 and radius2 about m2 [m].

    Raises:
        ConfigError: for a name in use, an unknown marker, one body twice, a law that is no
            `rom.mbs.Impact`, or a radius not above zero.
    """
    enter_contact(self, name, SPHERE, (m1, m2), law, (None, None), (radius2, radius1))


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
        name: name of the contact.
        m1: point of the axis of the cylinder.
        m2: centre of the sphere.
        law: force of the penetration.
        axis: (3,) of the cylinder, world at the start [1].
        radius1: of the cylinder [m].
        radius2: of the sphere [m].
        inside: the sphere is in the bore.

    Raises:
        ConfigError: for a sphere that does not fit into the bore, a name in use, an unknown marker,
            one body twice, a law that is no `rom.mbs.Impact`, or no direction.
    """
    if inside and radius2 >= radius1:
        raise ConfigError(
            f"contact {name!r}: the sphere of {radius2:g} m must be smaller than the bore of "
            f"{radius1:g} m; leave inside out for a sphere outside."
        )
    kind, radii = BORE if inside else CYLINDER, (radius2, radius1)
    enter_contact(self, name, kind, (m1, m2), law, (axis, None), radii)


def enter_contact(  # noqa: PLR0913  what the record holds
    self: Whole,
    name: str,
    kind: int,
    markers: Any,
    law: Impact,
    axes: Any,
    radius: Any,
    half: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Add a contact whose axes are given in the world at the start; None where it has none."""
    self.check_apart(name, *markers)
    directions = [
        np.zeros(3)
        if axis is None
        else rotation.matrix(self.part(marker.body).p).T @ unit_vector(f"axis of {name}", axis)
        for marker, axis in zip(markers, axes, strict=True)
    ]
    i, j = markers
    law = checked_law(name, law, self.part(i.body), self.part(j.body))
    self.add(name, Contact(kind, i, j, *directions, radius, law, half), CONTACTS_FAMILY)


@table
class Contacts(Table):
    """A sphere, disc or capsule on marker j that touches something on marker i.

    Attributes:
        kind: (c,) PLANE, SPHERE, CYLINDER, BORE, DISC or CAPSULE.
        i, j: (c,) markers.
        e: (c, 3) normal of the plane, or axis of what is on i, in the axes of i.
        s: (c, 3) axis of what is on j in the axes of j.
        size: (c, 4) radius on j, and on i, half the length of a capsule on j, and on i [m].
        law: (c, 5) stiffness, exponent, damping factor [s/m], friction coefficient, speed over
            which friction changes its sign [m/s].
        bristle: (c, 2) stiffness [N/m] and damping [N s/m] of friction that holds, zeros for none.
        remembered: (c,) first of the numbers that it remembers.
    """

    kind: Index1
    i: Index1
    j: Index1
    e: Array2
    s: Array2
    size: Array2
    law: Array2
    bristle: Array2
    remembered: Index1


def pack(contacts: Any, places: Places) -> Contacts:
    """The contacts as arrays."""
    found = contacts.values()
    laws = [c.law for c in found]
    numbers = [(x.stiffness, x.exponent, x.damping, x.mu, x.transition_speed) for x in laws]
    return Contacts(
        integers(c.kind for c in found),
        integers(places.marker[c.i] for c in found),
        integers(places.marker[c.j] for c in found),
        rows_of((c.e for c in found), 3),
        rows_of((c.s for c in found), 3),
        rows_of(((*c.radius, *c.half) for c in found), 4),
        rows_of(numbers, 5),
        rows_of(((x.tangential_stiffness or 0.0, x.tangential_damping) for x in laws), 2),
        integers(
            places.memory(name, np.zeros(N_REMEMBERED)) if c.law.tangential_stiffness else -1
            for name, c in contacts.items()
        ),
    )


def kept(contacts: "Contacts", memory: Array) -> Array:
    """(n_t,) energy in springs of friction, from what is remembered (n_t, p) [J]."""
    total: Array = memory[:, contacts.remembered[contacts.remembered >= 0] + STORED].sum(axis=1)
    return total


@inner
def touch(kind, size, gap, e, s):
    """Normal from i to j, depth of penetration, and vector from P_j to the touching point."""
    if kind == PLANE:
        return e, size[0] - dot(e, gap), scale(-size[0], e)
    if kind == DISC:
        c = dot(e, s)
        w = np.sqrt(1.0 - c * c)
        down = scale(size[0] / w, sub(scale(c, s), e))
        return e, size[0] * w - dot(e, gap), down
    out = scale(0.0, gap)
    if kind == CAPSULE:
        across, out = across_of(gap, e, s, size[3], size[2])
    elif kind == SPHERE:
        across = gap
    else:
        across = sub(gap, scale(dot(e, gap), e))
    far = np.sqrt(dot(across, across))
    if kind == BORE:
        n = scale(-1.0 / far, across)
        return n, far + size[0] - size[1], scale(-size[0], n)
    n = scale(1.0 / far, across)
    return n, size[0] + size[1] - far, sub(out, scale(size[0], n))


@inner
def contact_force(law, bristle, n, depth, down, motion):
    """Force on j, elastic force, closing speed, velocity of j over i where they touch, stretch.

    ``motion`` is the gap of the markers, their relative velocity, both angular velocities, and how
    far the ends of the spring of friction are apart.
    """
    gap, slide, Oi, Oj, apart = motion
    u = add(slide, sub(cross(Oj, down), cross(Oi, add(gap, down))))
    closing = -dot(n, u)
    elastic = law[0] * depth ** law[1]
    normal = elastic * (1.0 + law[2] * closing)
    if normal.real < 0.0:
        normal = 0.0 * normal
    across, stretch = add(u, scale(closing, n)), sub(apart, scale(dot(n, apart), n))
    if bristle[0] > 0.0:
        friction, stretch = spring_and_slider(bristle, law[3] * normal, stretch, across)
    else:
        drag = law[3] * normal / np.sqrt(dot(across, across) + law[4] * law[4])
        friction = scale(-drag, across)
    return add(scale(normal, n), friction), elastic, closing, u, stretch


@inner
def contact_state(contacts, k, W):
    """Axes of contact k in the world, relative motion of its markers, ends of its spring."""
    i, j = contacts.i[k], contacts.j[k]
    e, axle = turn(W.E, i, row(contacts.e, k, 0)), turn(W.E, j, row(contacts.s, k, 0))
    gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
    held, on_i, on_j = 0.0, e, e
    if contacts.remembered[k] >= 0:
        held, on_i, on_j = ends_of_spring(W, W.x.size + contacts.remembered[k], i, j)
    apart = scale(held, sub(add(gap, on_j), on_i))
    return e, axle, (gap, slide, row(W.V, i, 3), row(W.V, j, 3), apart), (held, on_i, on_j)


@residuals.of(Contacts)
def contact_wrenches(_s, W, contacts, _q, _v, _lam):
    """Add the contacts to the wrenches on the markers; add up the power lost."""
    for k in range(contacts.kind.size):
        i, j, at = contacts.i[k], contacts.j[k], contacts.remembered[k]
        e, axle, motion, _ = contact_state(contacts, k, W)
        n, depth, down = touch(contacts.kind[k], contacts.size[k], motion[0], e, axle)
        if not depth > 0.0:
            if at >= 0:
                forget_spring(W, at)
            continue
        bristle, arms = contacts.bristle[k], (add(motion[0], down), down)
        force, elastic, closing, u, stretch = contact_force(
            contacts.law[k], bristle, n, depth, down, motion
        )
        if at >= 0:
            keep_spring(W, at, (i, j), arms, stretch, bristle[0])
        at_i, at_j = cross(arms[0], force), cross(arms[1], force)
        for p in range(3):
            W.wrench[j, p] += force[p]
            W.wrench[j, 3 + p] += at_j[p]
            W.wrench[i, p] -= force[p]
            W.wrench[i, 3 + p] -= at_i[p]
        W.power[2] -= dot(force, u) + elastic * closing


@inner
def stepped(x, dx):
    """The vector x with an imaginary step along dx."""
    return (
        complex(x[0], COMPLEX_STEP * dx[0]),
        complex(x[1], COMPLEX_STEP * dx[1]),
        complex(x[2], COMPLEX_STEP * dx[2]),
    )


@inner
def contact_column(contacts, W, k, p, by_position, c):
    """Add c times the change of the wrenches in unit motion p, or unit velocity p, to W.Q."""
    e, axle, (gap, slide, Oi, Oj, apart), (held, on_i, on_j) = contact_state(contacts, k, W)
    vi, wi, vj, wj = unit_twist(p)
    move, rush = (1.0, 0.0) if by_position else (0.0, 1.0)
    moved = sub(add(vj, cross(wj, on_j)), add(vi, cross(wi, on_i)))
    normal = stepped(e, scale(move, cross(wi, e)))
    spin = stepped(axle, scale(move, cross(wj, axle)))
    gap = stepped(gap, scale(move, sub(vj, vi)))
    slide = stepped(slide, scale(rush, sub(vj, vi)))
    apart = stepped(apart, scale(move * held, moved))
    motion = gap, slide, stepped(Oi, scale(rush, wi)), stepped(Oj, scale(rush, wj)), apart
    n, depth, down = touch(contacts.kind[k], contacts.size[k], gap, normal, spin)
    force, _, _, _, _ = contact_force(contacts.law[k], contacts.bristle[k], n, depth, down, motion)
    at_j, at_i = cross(down, force), cross(add(gap, down), force)
    for q in range(3):
        W.Q[q, p] -= c / COMPLEX_STEP * force[q].imag
        W.Q[3 + q, p] -= c / COMPLEX_STEP * at_i[q].imag
        W.Q[6 + q, p] += c / COMPLEX_STEP * force[q].imag
        W.Q[9 + q, p] += c / COMPLEX_STEP * at_j[q].imag


@tangents.of(Contacts)
def contact_tangents(s, W, contacts, _lam, ck, cc):
    """Add the stiffness (times ck) and damping (times cc) of all contacts to W.Kt and W.S."""
    for k in range(contacts.kind.size):
        e, axle, motion, _ = contact_state(contacts, k, W)
        if not touch(contacts.kind[k], contacts.size[k], motion[0], e, axle)[1] > 0.0:
            continue
        W.Q[:] = 0.0
        for p in range(12):
            contact_column(contacts, W, k, p, True, -ck)
        pair_stiffness(s, W, contacts.i[k], contacts.j[k], W.Kt)
        W.Q[:] = 0.0
        for p in range(12):
            contact_column(contacts, W, k, p, False, -cc)
        pair_stiffness(s, W, contacts.i[k], contacts.j[k], W.S)


@energy.of(Contacts)
def contact_energy(_s, W, contacts, _q, _v):
    """Elastic energy in contacts, and in springs of their friction."""
    total = 0.0
    for k in range(contacts.kind.size):
        e, axle, motion, _ = contact_state(contacts, k, W)
        n, depth, down = touch(contacts.kind[k], contacts.size[k], motion[0], e, axle)
        if not depth > 0.0:
            continue
        law, bristle = contacts.law[k], contacts.bristle[k]
        stretch = contact_force(law, bristle, n, depth, down, motion)[4]
        total += law[0] * depth ** (law[1] + 1.0) / (law[1] + 1.0)
        total += 0.5 * bristle[0] * dot(stretch, stretch)
    return total


CONTACTS_FAMILY = Family(
    "contacts", Contact, pack, contact_wrenches, contact_tangents, contact_energy,
    hooks=Hooks(remembers=lambda contacts: contacts.remembered >= 0, kept=kept),
)  # fmt: skip
