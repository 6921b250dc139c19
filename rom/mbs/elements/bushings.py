"""Bushings: elastic and damped in six directions, large rotations of the whole included.

The state is the position of marker j in the axes of the bushing on marker i, and the rotation
vector between both; forces are work-conjugate to it, so that a constant or tabulated stiffness
has a potential whatever the rotation.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from rom import rotation
from rom.arguments import Number, Orientation, ascending, finite, one_of, unit_quaternion
from rom.errors import ConfigError
from rom.mbs.connections.ends import ends_of
from rom.mbs.elements.family import Family, Hooks, Places, integers, rows_of
from rom.mbs.kernels.algebra import (
    add,
    cross,
    dot,
    inverse_tangent,
    mtv,
    mv,
    place,
    row,
    scale,
    sub,
    transposed_rate,
    turn,
    unit,
    unit_twist,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness, push_pair
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Array3, Index1, Index2, Table, table
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Whole
from rom.model import Array

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
MAX_TURN = 0.95 * np.pi  # [rad]
Curve = tuple[npt.ArrayLike, npt.ArrayLike]  # displacements and forces
Curves = dict[str, Curve]


@dataclass(frozen=True, slots=True)
class Bushing:
    """Six springs and dampers between two markers; numbers as in `Bushings`."""

    i: Marker
    j: Marker
    frames: tuple[Array, Array]
    zero: Array
    stiffness: Array
    damping: Array
    curves: tuple[tuple[int, Array], ...]


def bushing(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    stiffness: Annotated[npt.ArrayLike, Number("1", (6,), (6, 6))],
    damping: Annotated[npt.ArrayLike, Number("1", (6,), (6, 6))] | None = None,
    axes: Orientation | None = None,
    curves: Curves | None = None,
) -> None:
    """Elastic and damped connection in six directions, without force at the start.

    Rotations count up to half a turn; a rotational spring about a joint counts whole turns.

    Args:
        m1: marker that carries the axes.
        m2: other marker; turned by less than half a turn against the first.
        stiffness: (6,) or symmetric (6, 6) [N/m, N/rad; N m/m, N m/rad], translations first,
            then rotations (vector of the rotation).
        damping: (6,) or symmetric (6, 6) likewise, times the rates [N s/m, N s/rad; N m s/m, N m
            s/rad]; None for none.
        axes: (3, 3) matrix or (4,) quaternion [1], bushing to world at the start; None: world.
        curves: {"x": (displacements, forces), ..., "rz": (angles, moments)} added to the
            stiffness: monotone cubic between ascending points, straight beyond them.

    Raises:
        ConfigError: for matrices without an energy, or tables that do not ascend.
    """
    ends, world = ends_of(self, name, m1, m2), rotation.matrix(unit_quaternion(axes))
    K = _matrix66(f"stiffness of {name}", stiffness)
    C = _matrix66(f"damping of {name}", np.zeros(6) if damping is None else damping)
    tables = tuple(_curve(name, *item) for item in (curves or {}).items())
    one, two = (A.T @ world for A in ends.frames)
    self.add(name, Bushing(m1, m2, (one, two), world.T @ ends.gap, K, C, tables), BUSHINGS_FAMILY)


def _matrix66(name: str, value: npt.ArrayLike) -> Array:
    """Symmetric, not negative (6, 6) matrix from itself or its diagonal."""
    A = finite(name, np.diag(value) if np.shape(value) == (6,) else value, (6, 6))
    size = np.abs(A).max()
    if np.abs(A - A.T).max() > 1e-9 * size:
        text = f"{name} is not symmetric by {np.abs(A - A.T).max():.3g}: no energy."
        raise ConfigError(text, hint="Bearings of eight coefficients are a law, see docs/laws.md.")
    if np.linalg.eigvalsh(A)[0] < -1e-9 * size:
        raise ConfigError(f"{name} must not be negative in a direction: it would drive the motion.")
    return 0.5 * (A + A.T)


def _curve(name: str, direction: str, table: Curve) -> tuple[int, Array]:
    """Direction and pieces (n, 7) of a tabulated force, see `Bushings`."""
    one_of(f"curve of bushing {name!r}", direction, DIRECTIONS)
    x = ascending(f"displacements of curve {direction} of bushing {name!r}", table[0])
    force = finite(f"curve {direction} of {name}", table[1], (x.size,))
    cubic = PchipInterpolator(x, force)
    energy = cubic.antiderivative()
    slopes = cubic.derivative()(x[[0, -1]])
    inner = np.column_stack([x[:-1], x[:-1], cubic.c[::-1].T, energy(x[:-1])])
    left = [-np.inf, x[0], force[0], slopes[0], 0.0, 0.0, energy(x[0])]
    right = [x[-1], x[-1], force[-1], slopes[1], 0.0, 0.0, energy(x[-1])]
    return DIRECTIONS.index(direction), np.vstack([left, inner, right])


@table
class Bushings(Table):
    """All bushings."""

    i: Index1  # (b,) marker
    j: Index1  # (b,) other marker
    frame_i: Array3  # (b, 3, 3) axes of the bushing in those of the marker
    frame_j: Array3  # (b, 3, 3) in those of the other marker
    zero: Array2  # (b, 3) position of j in these axes without force [m]
    stiffness: Array3  # (b, 6, 6) translations, then rotations
    damping: Array3  # (b, 6, 6) likewise
    curve: Index2  # (b, 6) first piece of a force over displacement, -1 for none
    pieces: Index2  # (b, 6) number of them
    piece: Array2  # (n, 7) lower end, origin, four coefficients of powers, energy at the origin


def pack(bushings: Mapping[str, Bushing], places: Places) -> Bushings:
    """Bushings with the pieces of their curves."""
    found = list(bushings.values())
    curve, pieces = np.full((len(found), 6), -1), np.zeros((len(found), 6))
    stack, n = [np.zeros((0, 7))], 0
    for k, bushing in enumerate(found):
        for p, piece in bushing.curves:
            curve[k, p], pieces[k, p] = n, len(piece)
            stack.append(piece)
            n += len(piece)
    return Bushings(
        integers(places.marker[b.i] for b in found),
        integers(places.marker[b.j] for b in found),
        *(rows_of((b.frames[side] for b in found), 3, 3) for side in (0, 1)),
        rows_of((b.zero for b in found), 3),
        rows_of((b.stiffness for b in found), 6, 6),
        rows_of((b.damping for b in found), 6, 6),
        curve.astype(np.int64),
        pieces.astype(np.int64),
        np.concatenate(stack),
    )


@inner
def rotation_vector(bushings, k, W):
    """Rotation from the bushing axes on i to those on j, in those on i; less than half a turn."""
    i, j = bushings.i[k], bushings.j[k]
    r = 0.0
    w = (0.0, 0.0, 0.0)
    for p in range(3):
        a = to_local(W, i, bushings.frame_i[k], turn(W.E, j, mv(bushings.frame_j[k], unit(p))))
        w = add(w, scale(0.5, cross(unit(p), a)))
        r += a[p]
    sine, cosine = math.sqrt(dot(w, w)), 0.5 * (r - 1.0)
    if sine < 1e-8:
        return w
    return scale(math.atan2(sine, cosine) / sine, w)


@inner
def to_local(W, i, frame, x):
    """World vector in the bushing axes on marker i."""
    return mtv(frame, mtv(W.E[i], x))


@inner
def to_world(W, i, frame, x):
    """Vector in the bushing axes on marker i in the world."""
    return turn(W.E, i, mv(frame, x))


@inner
def bushing_state(bushings, k, W):
    """Gap in the world, position and rotation vector, and their rates."""
    i, j, frame = bushings.i[k], bushings.j[k], bushings.frame_i[k]
    gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
    x = sub(to_local(W, i, frame, gap), row(bushings.zero, k, 0))
    theta = rotation_vector(bushings, k, W)
    xd = to_local(W, i, frame, sub(slide, cross(row(W.V, i, 3), gap)))
    spin = to_local(W, i, frame, sub(row(W.V, j, 3), row(W.V, i, 3)))
    return gap, x, theta, xd, inverse_tangent(theta, 1.0, spin)


@inner
def curve_state(bushings, k, p, x):
    """Force, slope and energy of direction p at the displacement x."""
    if bushings.curve[k, p] < 0:
        return 0.0, 0.0, 0.0
    at = bushings.curve[k, p] + bushings.pieces[k, p] - 1
    while x < bushings.piece[at, 0]:
        at -= 1
    c, d = bushings.piece[at], x - bushings.piece[at, 1]
    force = c[2] + d * (c[3] + d * (c[4] + d * c[5]))
    slope = c[3] + d * (2 * c[4] + 3 * d * c[5])
    return force, slope, c[6] + d * (c[2] + d * (c[3] / 2 + d * (c[4] / 3 + d * c[5] / 4)))


@inner
def six(a, b, p):
    """Entry p of the pair of vectors a, b."""
    return a[p] if p < 3 else b[p - 3]


@inner
def resisting(matrix, a, b, at):
    """Three rows of a (6, 6) matrix from ``at`` times the pair of vectors a, b."""
    y = (0.0, 0.0, 0.0)
    for q in range(6):
        z = six(a, b, q)
        y = add(y, (matrix[at, q] * z, matrix[at + 1, q] * z, matrix[at + 2, q] * z))
    return y


@inner
def along_curves(bushings, k, a, b, at, which):
    """Force (which = 0) or slope (1) of the curves of three directions from ``at``."""
    return (
        curve_state(bushings, k, at, six(a, b, at))[which],
        curve_state(bushings, k, at + 1, six(a, b, at + 1))[which],
        curve_state(bushings, k, at + 2, six(a, b, at + 2))[which],
    )


@inner
def bushing_loads(bushings, k, state):
    """Elastic and damping forces and moments that resist the state."""
    _, x, theta, xd, rate = state
    K, C = bushings.stiffness[k], bushings.damping[k]
    pull = add(resisting(K, x, theta, 0), along_curves(bushings, k, x, theta, 0, 0))
    twist = add(resisting(K, x, theta, 3), along_curves(bushings, k, x, theta, 3, 0))
    return pull, twist, resisting(C, xd, rate, 0), resisting(C, xd, rate, 3)


@inner
def bushing_force(bushings, k, W, state):
    """Force and moment of bushing k on marker j, world, and the power lost."""
    i, frame = bushings.i[k], bushings.frame_i[k]
    _, _, theta, xd, rate = state
    pull, twist, drag, brake = bushing_loads(bushings, k, state)
    force = to_world(W, i, frame, scale(-1.0, add(pull, drag)))
    moment = inverse_tangent(theta, -1.0, scale(-1.0, add(twist, brake)))
    return force, to_world(W, i, frame, moment), dot(drag, xd) + dot(brake, rate)


@residuals.of(Bushings)
def bushing_wrenches(_s, W, bushings, _q, _v, _lam):
    """Add the bushings to the wrenches on the markers; add up the power lost."""
    for k in range(bushings.i.size):
        i, j = bushings.i[k], bushings.j[k]
        state = bushing_state(bushings, k, W)
        force, moment, lost = bushing_force(bushings, k, W, state)
        push_pair(W, i, j, force, add(moment, cross(state[0], force)), moment)
        W.power[2] += lost


@tangents.of(Bushings)
def bushing_tangents(s, W, bushings, _lam, ck, cc):
    """Add the stiffness (times ck) and damping (times cc) of all bushings to W.Kt and W.S.

    The change of the rates with the position is left out.
    """
    for k in range(bushings.i.size):
        state = bushing_state(bushings, k, W)
        for moved in (True, False):
            W.Q[:] = 0.0
            for p in range(12):
                bushing_column(bushings, W, k, state, p, moved, ck if moved else cc)
            pair_stiffness(s, W, bushings.i[k], bushings.j[k], W.Kt if moved else W.S)


@inner
def bushing_column(bushings, W, k, state, p, moved, c):
    """Add c times the stiffness in unit motion p, or damping in unit velocity p, to W.Q."""
    gap, x, theta, _, _ = state
    i, frame = bushings.i[k], bushings.frame_i[k]
    vi, wi, vj, wj = unit_twist(p)
    dx = to_local(W, i, frame, sub(sub(vj, vi), cross(wi, gap)))
    dtheta = inverse_tangent(theta, 1.0, to_local(W, i, frame, sub(wj, wi)))
    A = bushings.stiffness[k] if moved else bushings.damping[k]
    pull, twist = resisting(A, dx, dtheta, 0), resisting(A, dx, dtheta, 3)
    force, moment, turning = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if moved:
        pull = add(pull, times(along_curves(bushings, k, x, theta, 0, 1), dx))
        twist = add(twist, times(along_curves(bushings, k, x, theta, 3, 1), dtheta))
        force, moment, _ = bushing_force(bushings, k, W, state)
        _, back, _, brake = bushing_loads(bushings, k, state)
        turning = transposed_rate(theta, dtheta, add(back, brake))
    twist = add(inverse_tangent(theta, -1.0, twist), turning)
    dforce = sub(cross(wi, force), to_world(W, i, frame, pull))
    dmoment = sub(cross(wi, moment), to_world(W, i, frame, twist))
    lever = add(cross(sub(vj, vi), force), cross(gap, dforce))
    place(W.Q, 0, p, c, dforce)
    place(W.Q, 3, p, c, add(dmoment, lever))
    place(W.Q, 6, p, -c, dforce)
    place(W.Q, 9, p, -c, dmoment)


@inner
def times(a, b):
    """Entries of a times those of b."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@energy.of(Bushings)
def bushing_energy(_s, W, bushings, _q, _v):
    """Elastic energy in bushings."""
    total = 0.0
    for k in range(bushings.i.size):
        _, x, theta, _, _ = bushing_state(bushings, k, W)
        K = bushings.stiffness[k]
        total += 0.5 * dot(x, resisting(K, x, theta, 0))
        total += 0.5 * dot(theta, resisting(K, x, theta, 3))
        for p in range(6):
            total += curve_state(bushings, k, p, six(x, theta, p))[2]
    return total


def turned_over(name: str, bushing: Bushing, t: Array, axes: Callable[[str], Array]) -> str:
    """That its rotation vector came near half a turn, where it begins anew on the other side."""
    if not (np.any(bushing.stiffness[3:]) or any(at > 2 for at, _ in bushing.curves)):
        return ""
    sides = zip((bushing.i, bushing.j), bushing.frames, strict=True)
    one, other = (axes(marker.body) @ frame for marker, frame in sides)
    turn = np.arccos(np.clip((np.einsum("tij,tij->t", one, other) - 1) / 2, -1, 1))
    if not np.nanmax(turn) > MAX_TURN:
        return ""
    k = int(np.nanargmax(turn > MAX_TURN))
    return (
        f"bushing {name!r} was turned by {turn[k]:.3g} rad at {t[k]:.4g} s: its "
        "moment jumps to the other side at half a turn. A rotational spring counts whole turns."
    )


KERNELS = bushing_wrenches, bushing_tangents, bushing_energy
BUSHINGS_FAMILY = Family("bushings", Bushing, pack, *KERNELS, hooks=Hooks(beyond=turned_over))
