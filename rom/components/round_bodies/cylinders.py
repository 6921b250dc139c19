"""How the cylindrical surface of a flexible body deforms, and forces anywhere on it.

A rim or a bore that was reduced with interface functions moves, beyond the mean motion of its
marker, by

    w(theta, zeta) = sum over f of B_f(theta, zeta) C_f q,

B_f harmonics around the axis times Legendre polynomials along it, zeta from -1 to 1. A force may
act at any place, so that one that travels around the rim needs no node under it.

Source:
    After Carassale and Maurici, J. Eng. Gas Turbines Power 140 (2018): functions on an interface
    that are chosen before anything is solved.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.sparse import spmatrix

from rom.body.records import Marker as Interface
from rom.body.records import Patch
from rom.errors import ConfigError, warn
from rom.mbs.elements.family import integers, rows_of
from rom.mbs.kernels.algebra import mtv, mv
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import block_of
from rom.mbs.kernels.tables import Array1, Array4, Index2, Scratch2, Scratch3, Table, table
from rom.mbs.parts.bodies import Marker, Part
from rom.model import Array

MAX_MISSED_RATIO = 0.02  # of the deformation, which functions may miss without a word
MOST_HARMONICS, MOST_ORDER = 12, 8  # of a surface whose functions do not say how many it has


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Deformation of a surface about an axis, without the mean motion of its marker."""

    harmonics: int  # highest harmonic around the axis
    order: int  # highest degree along it
    middle: float  # of the surface along the axis, from the marker [m]
    half_length: float  # of the surface along the axis [m]
    axes: Array  # (3, 3) rows: two directions across the axis, the axis itself; body frame
    # (f, 3, r) displacement [m] in the body frame per elastic coordinate; f counts the products of
    # the constant, cosine and sine of each harmonic with each polynomial, the harmonics of one
    # polynomial together
    shapes: Array
    missed: float  # largest share of the deformation of a shape that is in no function [1]

    def functions(self, theta: Array, z: Array) -> Array:
        """(k, f) values of the functions at angles (k,) [rad] and places (k,) [m] from the marker.

        Angles count from the first of the axes to the second.
        """
        n = np.arange(1, self.harmonics + 1)
        waves = np.stack([np.cos(np.outer(theta, n)), np.sin(np.outer(theta, n))], axis=2)
        around = np.hstack([np.ones((len(theta), 1)), waves.reshape(len(theta), -1)])
        along = legvander((z - self.middle) / self.half_length, self.order)
        return (along[:, :, None] * around[:, None, :]).reshape(len(theta), -1)


def deformable(part: Part, marker: Marker) -> tuple[Interface, Patch] | None:
    """The interface behind a marker and its surface, if it deforms; None of one that does not."""
    surface = part.moving.markers.get(marker.place) if part.flexible is not None else None
    return None if surface is None or surface.patch is None else (surface, surface.patch)


def cylinder_of(part: Part, marker: Marker, axis: Array, across: Array) -> Cylinder | None:
    """The deformation of the surface behind a marker; None of a rigid one.

    Its axis (3,) and a direction (3,) across are in the body frame.

    Warns:
        RomWarning: if harmonics and polynomials miss more than 2 % of the deformation of a shape.
    """
    deforms = deformable(part, marker)
    if deforms is None:
        return None
    (surface, patch), axes = deforms, np.array([across, np.cross(axis, across), axis])
    local = (patch.points - surface.point) @ axes.T
    theta, z = np.arctan2(local[:, 1], local[:, 0]), local[:, 2]
    if not np.ptp(z) > 0.0:
        text = f"interface {marker.place!r} of {part.name!r} is flat across the axis"
        raise ConfigError(f"{text}: take the cylinder face, or another axis.")
    harmonics, order = _numbers(surface.kind)
    middle, half = 0.5 * (z.max() + z.min()), 0.5 * float(np.ptp(z))
    found = Cylinder(harmonics, order, middle, half, axes, np.zeros((0, 3, 0)), 0.0)
    B, w = found.functions(theta, z), _deformation(surface, patch)
    S = patch.surface_mass
    C = np.linalg.lstsq(B.T @ (S @ B), B.T @ (S @ w), rcond=1e-10)[0]
    missed = _share_missed(S, w, w - B @ C)
    if missed > MAX_MISSED_RATIO:
        warn(
            f"{100 * missed:.0f} % of the deformation of interface {marker.place!r} of body "
            f"{part.name!r} is in no harmonic up to {harmonics} and no polynomial up to {order}, "
            "and stays unloaded: reduce it with such functions."
        )
    return replace(found, shapes=C.reshape(len(C), 3, -1), missed=missed)


def _numbers(kind: str) -> tuple[int, int]:
    """Harmonics and order of the functions that an interface follows, as its kind says."""
    numbers = [int(x) for x in kind.partition(":")[2].split(",") if x.strip().isdigit()]
    if not numbers:
        return MOST_HARMONICS, MOST_ORDER
    return numbers[0], max(numbers[-1], 1)


def _deformation(surface: Interface, patch: Patch) -> Array:
    """(k, 3 r) displacement of the nodes per elastic coordinate, less the motion of the marker."""
    r = surface.translation.shape[1]
    whole = surface.hold[:, 6:] if patch.shapes is None else patch.shapes @ surface.hold[:, 6:]
    turned = np.cross(surface.rotation.T[None], (patch.points - surface.point)[:, None], axis=2)
    mean = surface.translation.T[None] + turned
    return (np.asarray(whole).reshape(-1, 3, r) - mean.transpose(0, 2, 1)).reshape(-1, 3 * r)


def _share_missed(S: spmatrix, w: Array, left: Array) -> float:
    """Largest root of the mean square of what is left of a shape over the largest of all shapes."""
    size, remainder = (
        np.einsum("ki,ki->i", x, S @ x).reshape(3, -1).sum(axis=0) for x in (w, left)
    )
    return float(np.sqrt(remainder.max(initial=0.0) / max(size.max(initial=0.0), 1e-300)))


@table
class Cylinders(Table):
    """All surfaces of the elements of a family."""

    of: Index2  # (k, 2) surface of each side of an element, -1 of rigid ones
    size: Index2  # (c, 2) harmonics and order
    middle: Array1  # (c,) along the axis, from the marker [m]
    half_length: Array1  # (c,) along the axis [m]
    width: Array1  # (c,) angle over which a force is spread around the axis [rad]
    shapes: Array4  # (c, F, 3, R) displacement in the body frame per elastic coordinate [m]
    amplitude: Scratch2  # (c, 3 F) of functions at the last residual, three directions each [m]
    rate: Scratch2  # (c, 3 F) of these amplitudes [m/s]
    load: Scratch2  # (c, 3 F) sum of the forces times the functions [N]
    basis: Scratch3  # (m, 2, F) functions at places on either side
    # (4, 6 + R) motion along one and along another direction per velocity of a body, of both sides
    gradient: Scratch2


def pack_cylinders(
    sides: Sequence[Sequence[tuple[Cylinder, float] | None]], R: int, places: int
) -> Cylinders:
    """The surfaces of both sides of each element, and the angle over which forces spread [rad].

    Bodies have R elastic coordinates at most, and so many places are loaded at a time.
    """
    found = [one for pair in sides for one in pair if one is not None]
    number = {id(one): c for c, one in enumerate(found)}
    of = [[-1 if one is None else number[id(one)] for one in pair] for pair in sides]
    F = max((len(one.shapes) for one, _ in found), default=0)
    shapes = np.zeros((len(found), F, 3, R))
    for c, (one, _) in enumerate(found):
        shapes[c, : len(one.shapes), :, : one.shapes.shape[2]] = one.shapes
    return Cylinders(
        integers(x for pair in of for x in pair).reshape(-1, 2),
        integers(x for one, _ in found for x in (one.harmonics, one.order)).reshape(-1, 2),
        *rows_of(((one.middle, one.half_length, width) for one, width in found), 3).T.copy(),
        shapes,
        *np.zeros((3, len(found), 3 * F)),
        np.zeros((places, 2, F)),
        np.zeros((4, 6 + R)),
    )


@inner
def deform(s, cylinders, c, body, q, v):
    """Amplitudes of all functions of surface c and their rates; no loads yet."""
    shapes, at, vt = cylinders.shapes, s.bodies.q_at[body] + 7, s.bodies.v_at[body] + 6
    for f in range(shapes.shape[1]):
        for p in range(3):
            moved, rate = 0.0, 0.0
            for k in range(s.bodies.r[body]):
                moved += shapes[c, f, p, k] * q[at + k]
                rate += shapes[c, f, p, k] * v[vt + k]
            cylinders.amplitude[c, 3 * f + p] = moved
            cylinders.rate[c, 3 * f + p] = rate
            cylinders.load[c, 3 * f + p] = 0.0


@inner
def set_basis(cylinders, c, place, theta, z):
    """Write the functions at a place (number, side) at theta [rad] and z from the marker [m].

    They are mean values over the angle of a force.
    """
    harmonics, order = cylinders.size[c, 0], cylinders.size[c, 1]
    zeta = (z - cylinders.middle[c]) / cylinders.half_length[c]
    half, n_around = 0.5 * cylinders.width[c], 2 * harmonics + 1
    basis = cylinders.basis[place]
    basis[0] = 1.0
    for n in range(1, harmonics + 1):
        share = math.sin(n * half) / (n * half) if half > 0.0 else 1.0
        basis[2 * n - 1] = share * math.cos(n * theta)
        basis[2 * n] = share * math.sin(n * theta)
    before, now = 0.0, 1.0
    for degree in range(1, order + 1):
        before, now = now, ((2 * degree - 1) * zeta * now - (degree - 1) * before) / degree
        for f in range(n_around):
            basis[degree * n_around + f] = now * basis[f]


@inner
def n_functions(cylinders, c):
    """Number of functions of surface c."""
    return (2 * cylinders.size[c, 0] + 1) * (cylinders.size[c, 1] + 1)


@inner
def at_place(W, cylinders, c, place, body, amplitude):
    """Sum (3,) of amplitudes and functions at a place, in the world."""
    basis, x, y, z = cylinders.basis[place], 0.0, 0.0, 0.0
    for f in range(n_functions(cylinders, c)):
        x += basis[f] * amplitude[c, 3 * f]
        y += basis[f] * amplitude[c, 3 * f + 1]
        z += basis[f] * amplitude[c, 3 * f + 2]
    return mv(W.A[body], (x, y, z))


@inner
def load_surface(W, cylinders, c, place, body, force):
    """Let a force (3,) in the world act at a place."""
    basis, local = cylinders.basis[place], mtv(W.A[body], force)
    for f in range(n_functions(cylinders, c)):
        for p in range(3):
            cylinders.load[c, 3 * f + p] += basis[f] * local[p]


@inner
def spread_surface_loads(s, W, cylinders, c, body):
    """Subtract the loads of surface c, as elastic forces, from W.residual."""
    shapes, at = cylinders.shapes, s.bodies.v_at[body] + 6
    for f in range(shapes.shape[1]):
        for p in range(3):
            load = cylinders.load[c, 3 * f + p]
            for k in range(s.bodies.r[body]):
                W.residual[at + k] -= load * shapes[c, f, p, k]


@inner
def set_gradient(s, W, cylinders, place, marker, direction, lever):
    """Write what moves along a direction per velocity of the body of a marker to gradient[row].

    The place has the row, the surface, -1 of a rigid one, number and side; by the lever (3,) turns
    of the marker move along the direction (3,) in the world.
    """
    at, c, where, side = place
    b, gradient, H = s.markers.body[marker], cylinders.gradient, W.H
    if b < 0:
        return
    r = s.bodies.r[b]
    for k in range(6 + r):
        total = 0.0
        for p in range(3):
            total += direction[p] * H[marker, p, k] + lever[p] * H[marker, 3 + p, k]
        gradient[at, k] = total
    if c < 0:
        return
    x, shapes = mtv(W.A[b], direction), cylinders.shapes
    for f in range(n_functions(cylinders, c)):
        value = cylinders.basis[where, side, f]
        for k in range(r):
            along = x[0] * shapes[c, f, 0, k] + x[1] * shapes[c, f, 1, k]
            gradient[at, 6 + k] += value * (along + x[2] * shapes[c, f, 2, k])


@inner
def add_gradient_products(s, gradient, rows, markers, factor, S):
    """Add factor times gradient[rows of one side] x gradient[2 + other side] of bodies to S."""
    for row in range(2):
        for column in range(2):
            one, two = s.markers.body[markers[row]], s.markers.body[markers[column]]
            if one < 0 or two < 0:
                continue
            e = block_of(s.graph, one, two)
            first, left = s.graph.x[e], s.graph.y[e]
            for p in range(6 + s.bodies.r[one]):
                value = factor * gradient[rows[row], p]
                for q in range(6 + s.bodies.r[two]):
                    S[first + p, left + q] += value * gradient[2 + column, q]
