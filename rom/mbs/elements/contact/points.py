"""Contact of spheres, discs and capsules, planes and cylinders, with damping and friction.

All functions of one contact take real or complex numbers: the tangents are imaginary parts after
an imaginary step, exact to round-off.

Friction that truly holds has springs along the surfaces, which slip at Coulomb's limit. A spring
runs from a point of body i to a point of body j. Both are where the bodies touched at the last
accepted instant, less what the spring is stretched; seen from there the bodies slide by the way of
their points, whatever the step. What lies along the normal is dropped.

Source:
    Hunt, Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl.
    Mech. 42 (1975) 440. Complex step: Squire, Trapp, SIAM Review 40 (1998) 110. Jenkins, J. Appl.
    Mech. 29 (1962) 327 (spring and slider); Cundall, Strack, Geotechnique 29 (1979) 47 (in
    contacts that move); stiffness: Mindlin, J. Appl. Mech. 16 (1949) 259.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rom.mbs.elements.contact.impact import Impact
from rom.mbs.elements.family import Family, Hooks, Places, integers, rows_of
from rom.mbs.kernels.algebra import (
    add,
    cross,
    dot,
    mtv,
    put,
    row,
    scale,
    sub,
    turn,
    unit_twist,
    vec,
)
from rom.mbs.kernels.compiled import inner, kernel
from rom.mbs.kernels.constraints import pair_stiffness, push_pair
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.bodies import Marker
from rom.model import Array

PLANE, SPHERE, CYLINDER, BORE, DISC, CAPSULE = range(6)  # kinds of contacts
COMPLEX_STEP = 1e-30
# what a contact remembers: whether it touched, ends of its spring in the axes of i and j [m],
# energy in the spring [J]
HELD, ON_I, ON_J, STORED = 0, 1, 4, 7
N_REMEMBERED = 8
STICK_RTOL = 1e-9  # what slid to the limit sticks there when it is looked at again
PARALLEL_SQUARE = 1e-12  # squared sine between axes, below which the nearest points are not unique


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


@table
class Contacts(Table):
    """A sphere, disc or capsule on marker j that touches something on marker i."""

    kind: Index1  # (c,) PLANE, SPHERE, CYLINDER, BORE, DISC or CAPSULE
    i: Index1  # (c,) marker
    j: Index1  # (c,) other marker
    e: Array2  # (c, 3) normal of the plane, or axis of what is on i, in the axes of i
    s: Array2  # (c, 3) axis of what is on j in the axes of j
    size: Array2  # (c, 4) radius on j, and on i, half the length of a capsule on j, and on i [m]
    # (c, 5) stiffness, exponent, damping factor [s/m], friction coefficient, speed over which
    # friction changes its sign [m/s]
    law: Array2
    # (c, 2) stiffness [N/m] and damping [N s/m] of friction that holds, zeros for none
    bristle: Array2
    remembered: Index1  # (c,) first of the numbers that it remembers


def pack(contacts: Mapping[str, Contact], places: Places) -> Contacts:
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
    return memory[:, contacts.remembered[contacts.remembered >= 0] + STORED].sum(axis=1)


@inner
def within(x, half):
    """The number nearest to x between -half and half."""
    if x.real > half:
        return 0.0 * x + half
    if x.real < -half:
        return 0.0 * x - half
    return x


@inner
def middle_of_overlap(x, half_i, half_j):
    """Place on the first of two parallel pieces, the second one's middle x along it."""
    low = max(-half_i, x.real - half_j)
    high = min(half_i, x.real + half_j)
    return within(0.0 * x + 0.5 * (low + high), half_i)


@inner
def nearest(gap, e, s, half_i, half_j):
    """Places on both pieces, from their middles, between which they are nearest.

    The pieces are a e, |a| <= half_i, and gap + b s, |b| <= half_j. Where both places are inside,
    d = gap + b s - a e is normal to both axes; else one is held at its end, and the other is the
    foot of the perpendicular, or its own end.

    Source:
        Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    x, y, c = dot(gap, e), dot(gap, s), dot(e, s)
    sine = 1.0 - c * c
    if sine.real > PARALLEL_SQUARE:
        a = within((x - c * y) / sine, half_i)
    else:
        a = middle_of_overlap(x, half_i, half_j)
    b = within(c * a - y, half_j)
    return within(c * b + x, half_i), b


@inner
def across_of(gap, e, s, half_i, half_j):
    """Vector between the nearest points of two pieces, and that from the middle of the second."""
    a, b = nearest(gap, e, s, half_i, half_j)
    out = scale(b, s)
    return sub(add(gap, out), scale(a, e)), out


@kernel
def distance(gap, e, s, half_i, half_j):
    """Between two pieces, for arrays (3,)."""
    d = across_of(vec(gap, 0), vec(e, 0), vec(s, 0), half_i, half_j)[0]
    return math.sqrt(dot(d, d))


@inner
def shortened(x, limit):
    """The vector x, or one of length ``limit`` in its direction if it is longer."""
    size = np.sqrt(dot(x, x))
    if size.real > (1.0 + STICK_RTOL) * limit.real:
        return scale(limit / size, x)
    return x


@inner
def spring_and_slider(bristle, limit, stretch, slide):
    """Friction on j, and the stretch that remains; ``bristle`` is stiffness and damping."""
    stretch = shortened(stretch, limit / bristle[0])
    load = add(scale(bristle[0], stretch), scale(bristle[1], slide))
    return scale(-1.0, shortened(load, limit)), stretch


@inner
def keep_spring(W, at, markers, touching, stretch, stiffness):
    """Remember a spring; ``touching`` is the vector from each marker to the touching point."""
    i, j = markers
    W.fresh[at + HELD] = 1.0
    for p in range(3):
        W.fresh[at + ON_I + p] = W.fresh[at + ON_J + p] = 0.0
    put(W.fresh, at + ON_I, mtv(W.E[i], sub(touching[0], stretch)))
    put(W.fresh, at + ON_J, mtv(W.E[j], touching[1]))
    W.fresh[at + STORED] = 0.5 * stiffness * dot(stretch, stretch)


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
    """Axes of contact k in the world, relative motion of its markers, ends of its spring.

    With these, from the markers, whether the bodies touched at the last instant.
    """
    i, j = contacts.i[k], contacts.j[k]
    e, axle = turn(W.E, i, row(contacts.e, k, 0)), turn(W.E, j, row(contacts.s, k, 0))
    gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
    held, on_i, on_j = 0.0, e, e
    if contacts.remembered[k] >= 0:
        at = W.x.size + contacts.remembered[k]
        held = W.base[at + HELD]
        on_i, on_j = turn(W.E, i, vec(W.base, at + ON_I)), turn(W.E, j, vec(W.base, at + ON_J))
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
                W.fresh[at + HELD] = W.fresh[at + STORED] = 0.0
            continue
        bristle, arms = contacts.bristle[k], (add(motion[0], down), down)
        force, elastic, closing, u, stretch = contact_force(
            contacts.law[k], bristle, n, depth, down, motion
        )
        if at >= 0:
            keep_spring(W, at, (i, j), arms, stretch, bristle[0])
        at_i, at_j = cross(arms[0], force), cross(arms[1], force)
        push_pair(W, i, j, force, at_i, at_j)
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
        for by_position in (True, False):
            W.Q[:] = 0.0
            for p in range(12):
                contact_column(contacts, W, k, p, by_position, -ck if by_position else -cc)
            pair_stiffness(s, W, contacts.i[k], contacts.j[k], W.Kt if by_position else W.S)


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


KERNELS = contact_wrenches, contact_tangents, contact_energy
HOOKS = Hooks(remembers=lambda contacts: contacts.remembered >= 0, kept=kept)
CONTACTS_FAMILY = Family("contacts", Contact, pack, *KERNELS, hooks=HOOKS)
