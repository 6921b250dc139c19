"""Equilibrium of rods under dead loads: Newton's method with capped rotations, and continuation.

Beside `rom.equilibrium`, which finds the same shapes of rods in mechanisms, for what that has not:
rods without mass, loads that turn with the axes, any dof held, unstable shapes.

Source:
    See docs/theory/rods.md.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dgbtrf, dgbtrs
from scipy.sparse import dia_array

from rom.components.compiled import kernel
from rom.components.cosserat.energy import (
    BAND_WIDTH,
    HALF_BANDWIDTH,
    Rod,
    add_turning,
    internal,
    work,
)
from rom.components.cosserat.shapes import Shape, reference
from rom.errors import ConfigError, SolverError
from rom.mbs.kernels.algebra import rotation, turned, vec
from rom.model import Array, Mask
from rom.paths.load_steps import load_steps

MAX_ROTATION = 0.2  # rotation of an iteration [rad]: larger steps jump to other equilibria
INCREMENT_RTOL = 1e-8  # last increment, in rad and lengths of the rod; the next one is its square
MAX_ITERATIONS = 200
MIN_LOAD_STEP = 5e-5  # part of the load at which it is given up
UNIT_ROW = np.arange(BAND_WIDTH) == HALF_BANDWIDTH  # of a dof that is held

Loads = tuple[Array, Array]
Correction = Callable[[Shape, Array], Array | None]


@kernel
def add_loads(p, force, moment, W):
    """Subtract dead forces at the vertices and dead moments on plates and segments."""
    for i in range(force.shape[0]):
        for c in range(3):
            W.r[6 * i + 3 + c] -= force[i, c]
    for k in range(moment.shape[0]):
        rotation(p[k], 0, W.R)
        for c in range(3):
            W.a[c] = 0.0
            for d in range(3):
                W.a[c] += W.R[d, c] * moment[k, d]
            W.r[6 * k + c] -= W.a[c]
        add_turning(W.A, 6 * k, -1.0, W.a)


@kernel
def add_spin(rod, x, p, spin, W):
    """Add centrifugal forces and moments of steady rotation about an axis through the origin."""
    for i in range(rod.mass.size):
        for c in range(3):
            d, e, at = (c + 1) % 3, (c + 2) % 3, 6 * i + 3
            along = spin[0] * x[i, 0] + spin[1] * x[i, 1] + spin[2] * x[i, 2]
            square = spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]
            W.r[at + c] += rod.mass[i] * (spin[c] * along - square * x[i, c])
            W.A[at + c, HALF_BANDWIDTH] += rod.mass[i] * (spin[c] * spin[c] - square)
            W.A[at + c, d - c + HALF_BANDWIDTH] += rod.mass[i] * spin[c] * spin[d]
            W.A[at + c, e - c + HALF_BANDWIDTH] += rod.mass[i] * spin[c] * spin[e]
    for k in range(rod.inertia.shape[0]):
        rotation(p[k], 0, W.R)
        w, J, at = W.a, rod.inertia[k], 6 * k
        for c in range(3):
            w[c] = W.R[0, c] * spin[0] + W.R[1, c] * spin[1] + W.R[2, c] * spin[2]
        for c in range(3):  # J' w_d w_e, where a turn phi changes w by w x phi
            d, e = (c + 1) % 3, (c + 2) % 3
            more = J[e] - J[d]
            W.r[at + c] += more * w[d] * w[e]
            W.A[at + c, HALF_BANDWIDTH] += more * (w[e] * w[e] - w[d] * w[d])
            W.A[at + c, d - c + HALF_BANDWIDTH] += more * w[d] * w[c]
            W.A[at + c, e - c + HALF_BANDWIDTH] -= more * w[e] * w[c]


@kernel
def balance(rod, x, p, load, spin, W):
    """Set forces out of balance W.r and their tangent W.A at rest in turning axes."""
    internal(rod, x, p, np.zeros(W.r.size), W)
    add_loads(p, load[0], load[1], W)
    add_spin(rod, x, p, spin, W)


@kernel
def turn_all(p, phi):
    """Turn quaternions by rotations about their own axes."""
    for k in range(p.shape[0]):
        turned(p[k], 0, vec(phi[k], 0), p[k])


def newton(
    rod: Rod, shape: Shape, correction: Correction, more: npt.ArrayLike = ()
) -> tuple[Shape, Array] | None:
    """The shape near one where corrections vanish, and further unknowns; None if not found.

    The correction is a function of a shape and the further unknowns (k,) that gives increments (6 N
    + 9 + k,) in the order of `clamped`; None where its equations are singular.
    """
    x, p, unknown = shape.x.copy(), shape.p.copy(), np.array(more, dtype=float)
    n, length = 6 * rod.h.size + 9, rod.h.sum()
    turns, ways = (d := np.zeros(n + 3)).reshape(-1, 2, 3).swapaxes(0, 1)
    for _ in range(MAX_ITERATIONS):
        found = correction(Shape(x, p), unknown)
        if found is None or not np.isfinite(found).all():
            return None
        d[:n] = found[:n]
        angle, moved = np.abs(turns).max(), np.abs(ways).max() / length
        factor = min(1.0, MAX_ROTATION / max(angle, MAX_ROTATION))
        x += factor * ways[:-1]
        turn_all(p, factor * turns)
        unknown += factor * found[n:]
        if max(angle, moved) < INCREMENT_RTOL:
            return Shape(x, p), unknown
    return None


def clamped(rod: Rod, *, start: bool = True, end: bool = False) -> Mask:
    """(6 N + 9,) which dofs are free when plates are held; order plate, x_0, segment, x_1, ..."""
    free = np.ones(6 * rod.h.size + 9, dtype=np.bool_)
    free[:6], free[-6:] = not start, not end
    return free


def loads(
    rod: Rod,
    *,
    tip: npt.ArrayLike = 0.0,
    tip_moment: npt.ArrayLike = 0.0,
    force: npt.ArrayLike = 0.0,
    weight: npt.ArrayLike = 0.0,
) -> tuple[Array, Array]:
    """Dead forces (N + 1, 3) on vertices [N], moments (N + 2, 3) on plate, segments, plate [N m].

    Args:
        rod: the rod.
        tip: (3,) force on the last vertex [N].
        tip_moment: (3,) moment on the plate at the end [N m].
        force: (N + 1, 3) forces on the vertices [N].
        weight: (3,) acceleration of gravity [m/s^2].
    """
    f, m = np.zeros_like(rod.x), np.zeros((rod.h.size + 2, 3))
    f += np.asarray(force, dtype=float) + np.outer(rod.mass, np.broadcast_to(weight, 3))
    f[-1] += tip
    m[-1] += tip_moment
    return f, m


def fitting(
    rod: Rod, load: tuple[npt.ArrayLike, npt.ArrayLike], free: npt.ArrayLike | None
) -> tuple[tuple[Array, Array], Mask]:
    """Loads, and which dofs are free, as arrays."""
    free = clamped(rod) if free is None else np.asarray(free, dtype=bool)
    force, moment = (np.array(part, dtype=float) for part in load)
    found, needed = (force.shape, moment.shape), (rod.x.shape, (len(rod.p), 3))
    n = 6 * rod.h.size + 9
    if found != needed or free.shape != (n,):
        text = f"loads of shapes {found} and {free.size} dofs"
        raise ConfigError(f"{text}; needed are {needed} and {n} dofs.")
    return (force, moment), free


def equilibrium(
    rod: Rod,
    load: tuple[Array, Array],
    *,
    free: npt.ArrayLike | None = None,
    start: Shape | None = None,
    steps: int = 6,
    spin: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Shape:
    """Shape of a rod at rest under dead loads, or in steady rotation.

    The load grows from zero, or the shape follows from ``start`` in one step. Rotations of an
    iteration are capped, and a part of the load that fails is halved.

    Args:
        rod: the rod.
        load: forces and moments, see `loads`.
        free: (6 N + 9,) which dofs may move [1]; without it the plate at the start is clamped.
        start: a shape near the solution, from which no continuation is needed.
        steps: parts in which the load grows, and the square of the speed.
        spin: (3,) angular velocity of the axes about their origin [rad/s], in which the rod rests
            and the loads keep their direction.

    Raises:
        ConfigError: if shapes of arrays differ from those of the rod.
        SolverError: if no equilibrium was found; its ``solution`` is the last good shape and
            its ``share`` the part of the load it carries.
    """
    shape = reference(rod) if start is None else start
    (force, moment), free = fitting(rod, load, free)
    W, speed = work(rod), np.array(spin, dtype=float)
    band = np.zeros((3 * HALF_BANDWIDTH + 1, W.r.size), order="F")

    def correction(share: float, shape: Shape, _: Array) -> Array | None:
        balance(rod, shape.x, shape.p, (share * force, share * moment), share**0.5 * speed, W)
        W.A[~free] = UNIT_ROW
        band[HALF_BANDWIDTH:] = W.A.T  # that of the transposed tangent, as LAPACK stores it
        lu, pivots, singular = dgbtrf(band, HALF_BANDWIDTH, HALF_BANDWIDTH, overwrite_ab=True)
        if singular:
            return None
        right = np.where(free, -W.r, 0.0)
        return dgbtrs(lu, HALF_BANDWIDTH, HALF_BANDWIDTH, right, pivots, trans=1)[0]

    def ahead(shape: Shape, share: float) -> Shape | None:
        found = newton(rod, shape, partial(correction, share))
        return None if found is None else found[0]

    first = 1.0 / steps if start is None else 1.0
    share, shape = load_steps(ahead, shape, least=MIN_LOAD_STEP, first=first)
    if share < 1.0:
        text = f"no equilibrium beyond {100 * share:.4g} % of the load."
        error = SolverError(text, hint="The rod buckles or is left free.", solution=shape)
        error.share = share  # type: ignore[attr-defined]
        raise error
    return shape


def linearised(
    rod: Rod,
    shape: Shape,
    load: tuple[Array, Array] | None = None,
    spin: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> tuple[Array, Array]:
    """(n,) forces out of balance [N, N m] and (n, n) tangent [N/m, N/rad, N m/rad].

    Unknowns are in the order of `clamped`. Both count positions in world axes and rotations in
    section axes; the tangent is the exact derivative, symmetric where moments balance. The load is
    as of `loads`, the spin the angular velocity (3,) of the axes about their origin [rad/s].
    """
    W = work(rod)
    given = loads(rod) if load is None else load
    balance(rod, shape.x, shape.p, given, np.array(spin, dtype=float), W)
    offsets = np.arange(HALF_BANDWIDTH, -HALF_BANDWIDTH - 1, -1)
    return W.r, dia_array((W.A.T, offsets), (W.r.size, W.r.size)).toarray().T
