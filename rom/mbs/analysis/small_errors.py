"""What a small residual in the equations of motion moves, linear about the motion.

    M d'' + C d' + K d + G^T dlam = -R,   G d = 0

The equations are in axes of the bodies, where joints turn them slowly, and constant over pieces of
the motion. Of motions d = N z that joints allow, N changes linearly over a piece, from what they
allow at one end to what they allow at the other.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import block_diag, qr

from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import linearize_constraints, residual, retract, tangents
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.results.recomputed import evaluate_at
from rom.mbs.results.solution import Solution
from rom.model import Array, Index
from rom.rotation import matrix, skew

MAX_TURN = 0.2  # of what the joints leave free, in one piece [rad]
LOOKS = 60  # instants at which joints are asked for this
CARRIED = 10.0  # instants that elastic energy counts where pieces meet
STILL_RTOL = 1e-9  # stiffness of motions that do not deform, of the largest one


class Allowed(NamedTuple):
    """What joints allow at an instant, in axes of the bodies."""

    held: Array  # (n, rank) motions they stop, orthonormal where those of `Packed.unit` are
    free: Array  # (n, f) motions they allow
    reaction: Array  # (n, m) their multipliers by forces


def axes_of_bodies(rich: Solution) -> Array:
    """(n_t, b, 3, 3) axes of all bodies in the world."""
    A = [matrix(rich.q[:, at + 3 : at + 7].T) for at in rich.packed.system.bodies.q_at]
    return np.moveaxis(np.array(A), -1, 0)


def _turned(rich: Solution, x: Array, axes: Array) -> Array:
    """(n_t, n) with translations of bodies in the axes (n_t, b, 3, 3), columns of these."""
    out = x.copy()
    for b, at in enumerate(rich.packed.system.bodies.v_at):
        out[..., at : at + 3] = np.einsum(
            "...a,...ab->...b", x[..., at : at + 3], axes[..., b, :, :]
        )
    return out


def _looked_at(rich: Solution, W: Work, k: int) -> tuple[Array, ...]:
    """Evaluate everything of an instant; its q, v, a, lam."""
    packed = rich.packed
    evaluate_at(packed.system, W, rich.q[k], rich.v[k], packed.places.before(rich.base[: k + 1])[k],
                rich.signals[k])  # fmt: skip
    return rich.q[k], rich.v[k], rich.a[k], rich.lam[k]


def _allowed(rich: Solution, W: Work, k: int, A: Array) -> Allowed:
    q, v, *_ = _looked_at(rich, W, k)
    linearize_constraints(rich.packed.system, W, q, v)
    unit, rank = rich.packed.unit, rich.final.rank
    G = _turned(rich, W.G.copy(), A) * unit
    Q, U, order = qr(G.T, pivoting=True)
    reaction = np.zeros((len(Q), len(G)))
    reaction[:, order[:rank]] = Q[:, :rank] @ np.linalg.inv(U[:rank, :rank]).T
    return Allowed(Q[:, :rank], unit[:, None] * Q[:, rank:], unit[:, None] * reaction)


def _equations(rich: Solution, W: Work, k: int, A: Array) -> tuple[Array, ...]:
    """M, C, K of small motions about an instant; d' of velocities by d, of accelerations by both.

    In axes that turn, velocities are d' + w x d, and accelerations of second order in w.
    """
    packed = rich.packed
    q, v, a, lam = _looked_at(rich, W, k)
    apply_laws(packed.asked, W, float(rich.t[k]), slopes=True)
    residual(packed.system, W, q, v, a, lam)
    tangents(packed.system, W, v, a, lam, (0.0, 1.0, 1.0))
    C, K = W.S.copy(), W.Kt.copy()
    linearize_constraints(packed.system, W, q, v)
    M, C, K = (_turned(rich, _turned(rich, x, A).T, A).T for x in (W.S.copy(), C, K))
    spin, twice, square = np.zeros((3, *M.shape))
    for at in packed.system.bodies.v_at:
        x, turn = slice(at, at + 3), slice(at + 3, at + 6)
        w, dw = skew(v[turn]), skew(a[turn])
        spin[x, x], twice[x, x], square[x, x] = w, 2 * w, w @ w + dw
        spin[turn, turn], twice[turn, turn], square[turn, turn] = w, w, dw
    return M, C + M @ twice, K + C @ spin + M @ square, spin, twice, square


def _ends(rich: Solution, W: Work, axes: Array, pieces: int) -> Index:
    """Instants between which joints turn what they leave free by little."""
    looks = np.unique(np.linspace(0, rich.t.size - 1, LOOKS).astype(int))
    spans = [_allowed(rich, W, k, axes[k]).held for k in looks]
    least = [np.linalg.svd(a.T @ b, compute_uv=False).min(initial=1.0) for a, b in pairwise(spans)]
    turned = np.cumsum(np.r_[0.0, np.arccos(np.clip(least, 0.0, 1.0))])
    n = int(max(turned[-1] / MAX_TURN, pieces))
    progress = turned / n + np.linspace(0.0, MAX_TURN, looks.size)
    ends = np.interp(np.linspace(0.0, progress[-1], n + 1), progress, looks)
    return np.unique(np.round(ends).astype(int))


def _nearest(free: Array, last: Array, W: Array) -> Array:
    """Of motions (n, f) those nearest to others, in a metric W (n, n)."""
    weighed = free.T @ W
    return free @ np.linalg.solve(weighed @ free, weighed @ last)


class Piece(NamedTuple):
    """Equations z'' = A (z, z') - P R of a piece; d = (N + s dN) z, s the time from its middle."""

    A: Array  # (f, 2 f)
    P: Array  # (f, n)
    N: Array  # (n, f)
    dN: Array
    M: Array  # (n, n)
    forces: Array  # (n, 2 f) of z and z'
    spins: tuple[Array, ...]  # see `_equations`


def _piece(
    rich: Solution, W: Work, k: int, A: Array, ends: tuple[Array, Array], times: tuple[float, float]
) -> tuple[Piece, Array]:
    """The piece about an instant, and what z means at its end; motions free at its ends are given.

    Motions are led from the first end over the middle to the last one as that costs least mass and
    elastic energy: what is stiff would else be stretched where joints turn.
    """
    span, step = times
    M, C, K, *spins = _equations(rich, W, k, A)
    N = _allowed(rich, W, k, A).free
    metric = M + (CARRIED * step) ** 2 * _elastic_stiffness(rich.packed)
    N = _nearest(N, ends[0], metric)
    there = _nearest(ends[1], N, metric)
    dN = (there - ends[0]) / span
    forces = np.hstack([K @ N + C @ dN, C @ N + 2 * M @ dN])
    P = np.linalg.solve(N.T @ M @ N, N.T)
    return Piece(P @ -forces, P, N, dN, M, forces, tuple(spins)), there


def _motions(piece: Piece, y: Array, f: Array, s: Array) -> tuple[Array, Array, Array]:
    """(n_t, n) d, what it adds to velocities and to accelerations, at times s (n_t,) of a piece."""
    spin, twice, square = piece.spins
    (z, zd), zdd, s = np.split(y, 2, axis=1), y @ piece.A.T + f, s[:, None]
    d = z @ piece.N.T + s * (z @ piece.dN.T)
    rate = zd @ piece.N.T + (z + s * zd) @ piece.dN.T
    second = zdd @ piece.N.T + 2 * zd @ piece.dN.T
    return d, rate + d @ spin.T, second + rate @ twice.T + d @ square.T


def corrected(rich: Solution, R: Array, pieces: int) -> Solution:
    """The motion with what the residuals R (n_t, n) move, in at least so many pieces."""
    packed, t, axes = rich.packed, rich.t, axes_of_bodies(rich)
    W, unit = workspace(packed.system, len(packed.signals)), packed.unit[:, None]
    R, ends = _turned(rich, R, axes), _ends(rich, W, axes, pieces)
    moved, pull = np.zeros((3, *R.shape)), R.copy()
    here = _allowed(rich, W, 0, axes[0]).free
    y = _start(rich, here, R[0])
    for first, end in pairwise(ends):
        rows, k, span = slice(first, end + 1), (first + end) // 2, float(t[end] - t[first])
        there = _allowed(rich, W, end, axes[end]).free
        both = (here, there), (span, span / (end - first))
        piece, last = _piece(rich, W, k, axes[k], *both)
        f = -R[rows] @ piece.P.T
        found = answers(piece.A, y, t[rows], f)
        moved[:, rows] = _motions(piece, found, f, t[rows] - t[first] - span / 2)
        inertia = (found @ piece.A.T + f) @ (piece.M @ piece.N).T
        pull[rows] = R[rows] + inertia + found @ piece.forces.T
        back, here = np.linalg.lstsq(there / unit, last / unit, rcond=None)[0], there
        y = (found[-1].reshape(2, -1) @ back.T).ravel()
    d, rate, second = (_turned(rich, x, axes.swapaxes(-1, -2)) for x in moved)
    q = np.empty_like(rich.q)
    for k, step in enumerate(d):
        retract(packed.system, rich.q[k], step, q[k])
    v, a, lam = rich.v + rate, rich.a + second, rich.lam - _multipliers(rich, W, axes, pull)
    return replace(rich, q=q, v=v, a=a, lam=lam, _tracks={})


def _multipliers(rich: Solution, W: Work, axes: Array, pull: Array) -> Array:
    """(n_t, m) of forces (n_t, n) that joints take up; rows of joints turn with the bodies."""
    spins = [
        np.linalg.norm(rich.v[:, at + 3 : at + 6], axis=1) for at in rich.packed.system.bodies.v_at
    ]
    turned = cumulative_trapezoid(np.max(spins, axis=0), rich.t, initial=0.0)
    looks = np.unique(np.r_[np.unique(turned // MAX_TURN, return_index=True)[1], rich.t.size - 1])
    found = np.zeros_like(rich.lam)
    here = _allowed(rich, W, 0, axes[0]).reaction
    for first, end in pairwise(looks):
        there = _allowed(rich, W, end, axes[end]).reaction
        rows, share = slice(first, end + 1), np.linspace(0.0, 1.0, end - first + 1)[:, None]
        found[rows] = (1 - share) * (pull[rows] @ here) + share * (pull[rows] @ there)
        here = there
    return found


def _elastic_stiffness(packed: Packed) -> Array:
    """(n, n) stiffness of the bodies alone."""
    bodies = packed.system.bodies
    each = zip(bodies.flex, bodies.r, strict=True)
    return block_diag(*(block_diag(np.zeros((6, 6)), bodies.K[f, :r, :r]) for f, r in each))


def _start(rich: Solution, N: Array, R: Array) -> Array:
    """(2 f,) at rest: undeformed if the motion began so, else in equilibrium with its loads."""
    z = np.zeros(N.shape[1])
    if any(rich.elastic(name)[0].any() for name, part in rich.mechanism.parts.items() if part.r):
        stiff = _elastic_stiffness(rich.packed)
        z = -np.linalg.pinv(N.T @ stiff @ N, rcond=STILL_RTOL, hermitian=True) @ (N.T @ R)
    return np.r_[z, np.zeros_like(z)]


def answers(A: Array, start: Array, t: Array, f: Array) -> Array:
    """(n_t, 2 n) z and z' of z'' = A (z, z') + f, A (n, 2 n), f (n_t, n) linear between times.

    By (1 + x/3) / (1 - 2 x/3 + x^2/6) for exp(x): of third order, and what is too quick for the
    times rests in equilibrium with its loads.

    Source:
        Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.3: the Pade
        approximation (1, 2), of method Radau IIA.
    """
    n, found, h = len(A), np.empty((t.size, start.size)), 0.0
    whole, one = np.vstack([np.eye(n, 2 * n, n), A]), np.eye(2 * n)
    found[0] = start
    for k, step in enumerate(np.diff(t)):
        if abs(step - h) > 1e-9 * step:
            h, x = step, step * whole
            parts = one + x / 3, h * (one - x / 6)[:, n:], h * (one / 2 - x / 6)[:, n:]
            found_by = np.linalg.solve(one - 2 * x / 3 + x @ x / 6, np.hstack(parts))
            P, load, rise = np.split(found_by, [2 * n, 3 * n], axis=1)
            pushed = f[:-1] @ load.T + np.diff(f, axis=0) @ rise.T
        found[k + 1] = P @ found[k] + pushed[k]
    return found
