"""Elements whose tangents change within a step, renewed without another factorisation.

A film that begins to carry, or ceases to, holds its journal otherwise from one correction to the
next, while all the rest of the iteration matrix stays for many steps. With d = B v the motions of
markers against each other and D the change of their part since A was factorised,

    (A + B^T D B)^-1 r = y - Z (1 + D G)^-1 D B y,    y = A^-1 r,  Z = A^-1 B^T,  G = B Z.

Source:
    Woodbury, Inverting modified matrices, Princeton 1950; Hager, SIAM Review 31 (1989) 221.
"""

from numba import types

from rom.mbs.equations.linear_solve import solve_bordered
from rom.mbs.kernels.algebra import back_substitute, factorise
from rom.mbs.kernels.compiled import copy, inner
from rom.mbs.kernels.element_calls import pair_tangents
from rom.mbs.kernels.stages import REAL_VECTOR, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work

# elements: the dense equations of more would cost as much as a factorisation; velocities: with
# fewer, slopes of films in every correction cost more than factorisations now and then
MAX_RENEWED, MIN_VELOCITIES = 16, 100


def _is_renewed(system):
    return len(system.renewed) > 0


@inner
def set_pair_tangents(s, W, ck, cc):
    """Set W.pairs to ck times stiffness and cc times damping of all elements that are renewed."""
    first = 0
    for k in range(s.elements.shape[0]):
        first += pair_tangents(s, k, W, ck, cc, first)


@stage(types.void, System, Work, types.float64, types.float64, needed=_is_renewed)
def keep_pair_tangents(s, W, ck, cc):
    """Keep what is in the matrix factorised now, and the motions it belongs to."""
    set_pair_tangents(s, W, ck, cc)
    copy(W.pairs, W.pairs_lu)
    W.has_response[0] = 0
    W.approach[:] = 0.0
    for e in range(s.renewed.shape[0]):
        for side in range(2):
            m = s.renewed[e, side]
            b, sign = s.markers.body[m], 1.0 - 2.0 * side
            for p in range(6):
                for k in range(6 + s.bodies.r[b] if b >= 0 else 0):
                    W.approach[6 * e + p, s.bodies.v_at[b] + k] += sign * W.H[m, p, k]


@inner
def set_response(s, W, rank):
    """Solve for the rows of the motions, with the factors at hand."""
    n = W.residual.size
    for c in range(W.approach.shape[0]):
        for i in range(n):
            W.rhs[i] = W.approach[c, i]
        W.part[:] = 0.0
        solve_bordered(s, W, rank, W.response[c, :n], W.response[c, n:])
    for c in range(W.approach.shape[0]):
        for d in range(W.approach.shape[0]):
            total = 0.0
            for i in range(n):
                total += W.approach[c, i] * W.response[d, i]
            W.yielding[c, d] = total
    W.has_response[0] = 1


@stage(types.boolean, System, Work, types.float64, types.float64, types.int64, needed=_is_renewed)
def renew_pair_tangents(s, W, ck, cc, rank):
    """Factorise 1 + D G for the tangents now; False when it is singular."""
    if W.has_response[0] == 0:
        set_response(s, W, rank)
    set_pair_tangents(s, W, ck, cc)
    size = W.yielding.shape[0]
    for e in range(s.renewed.shape[0]):
        for p in range(6):
            row = 6 * e + p
            for d in range(size):
                W.renewal[row, d] = 1.0 if d == row else 0.0
            for q in range(6):
                change = W.pairs[e, p, q] - W.pairs_lu[e, p, q]
                for d in range(size):
                    W.renewal[row, d] += change * W.yielding[6 * e + q, d]
    return factorise(W.renewal, size, W.renewal_pivot)


@stage(types.void, System, Work, REAL_VECTOR, REAL_VECTOR, needed=_is_renewed)
def add_renewed(s, W, x, lam):
    """Take a solution x, lam of the old tangents to the one of those of `renew_pair_tangents`."""
    n, size, part = x.size, W.yielding.shape[0], W.renewal_part
    for e in range(s.renewed.shape[0]):
        for p in range(6):
            part[6 * e + p] = 0.0
        for q in range(6):
            speed = 0.0
            for i in range(n):
                speed += W.approach[6 * e + q, i] * x[i]
            for p in range(6):
                part[6 * e + p] += (W.pairs[e, p, q] - W.pairs_lu[e, p, q]) * speed
    back_substitute(W.renewal, size, W.renewal_pivot, part)
    for c in range(size):
        for i in range(n):
            x[i] -= part[c] * W.response[c, i]
        for k in range(lam.size):
            lam[k] -= part[c] * W.response[c, n + k]
