"""The linear equations [S G^T; G 0] of a step or an instant: filled, factorised, solved.

By blocks along the graph of the mechanism where that is quicker, leaf to root, at linear cost for
chains and trees of bodies; as a whole matrix otherwise, and also where a block is singular for
itself. With A = [A_kk R; B C], node k leaves R replaced by X = A_kk^-1 R and C by C - B X. For a
tree whose joints follow their outer body this is the recursion of the articulated inertias, and C
gets no new blocks; closed loops and forces between distant bodies add blocks along the way.

Source:
    Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 7, and sections 6.5 and 8.
"""

import math

from numba import types

from rom.mbs.kernels.algebra import back_substitute, factorise, range_basis, subtract_row
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.markers import own_corner
from rom.mbs.kernels.stages import REAL_MATRIX, REAL_VECTOR, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work

# by how much a constraint gives way where some repeat others, in units of mass and gradient: far
# more than round-off, far less than independent ones resist
MIN_SOFTNESS, MAX_SOFTNESS = 1e-10, 1e-8
# pivot of a node, relative to its largest one and to unit masses and gradients, that may be
# nothing but round-off
PIVOT_RTOL = 1e-13


@inner
def fill_blocks(s, W):
    """Write [S, UG^T; UGT, -soft], scaled by W.scaling, into W.factor in the order of the plan.

    Nothing is soft unless constraints may repeat others.
    """
    bodies, graph, P, F, d = s.bodies, s.graph, s.graph.plan, W.factor, W.scaling
    n = W.residual.size
    F[:] = 0.0
    for b in range(bodies.mass.size):
        for e in range(graph.first[b], graph.first[b + 1]):
            t, u = bodies.v_at[b], bodies.v_at[graph.other[e]]
            for i in range(6 + bodies.r[b]):
                to = P.block_to[e] + i * P.block_stride[e]
                for j in range(6 + bodies.r[graph.other[e]]):
                    F[to + j] = W.S[graph.x[e] + i, graph.y[e] + j] * d[t + i] * d[u + j]
    for k in range(s.rows.kind.size):
        for p in range(4):
            b = graph.body[k, p]
            for q in range(6 + bodies.r[b] if b >= 0 else 0):
                c = d[n + k] * d[bodies.v_at[b] + q]
                F[P.row_to[k, p] + q] = W.UGT[k, graph.at[k, p] + q] * c
                F[P.row_back[k, p] + q * P.row_stride[k, p]] = W.UG[k, graph.at[k, p] + q] * c
        if graph.shares != 0:
            F[P.corner[k]] = -W.soft[k]


@inner
def eliminate(P, F, pivot, spare):
    """Factorise in place; False when a node has no safe pivot."""
    for k in range(P.size.size):
        d, c = P.size[k], P.wide[k]
        A = F[P.pivot[k] : P.pivot[k] + d * d].reshape((d, d))
        turns = pivot[P.start[k] : P.start[k] + d]
        if not factorise(A, d, turns) or weak(A):
            return False
        if c > 0:
            X = F[P.right[k] : P.right[k] + d * c].reshape((d, c))
            divide(A, turns, X)
            L = F[P.below[k] : P.below[k] + c * d].reshape((c, d))
            subtract_product(P, k, L, X, F, spare)
    return True


@inner
def weak(A):
    """Whether the pivots of a factorised node are so different that nothing is left of one."""
    least, most = abs(A[0, 0]), abs(A[0, 0])
    for i in range(A.shape[0]):
        least, most = min(least, abs(A[i, i])), max(most, abs(A[i, i]))
    return not least > PIVOT_RTOL * max(most, 1.0)


@inner
def divide(A, turns, X):
    """Replace the rows of X by those of A^-1 X, with the factors of A."""
    d, c = X.shape
    for k in range(d):
        p = turns[k]
        for j in range(c if p != k else 0):
            X[k, j], X[p, j] = X[p, j], X[k, j]
    for i in range(d):
        for k in range(i):
            if A[i, k] != 0.0:
                subtract_row(A[i, k], X, i, k, 0, c)
    for i in range(d - 1, -1, -1):
        for k in range(i + 1, d):
            if A[i, k] != 0.0:
                subtract_row(A[i, k], X, i, k, 0, c)
        f = 1.0 / A[i, i]
        for j in range(c):
            X[i, j] *= f


@inner
def subtract_product(P, k, L, X, F, spare):
    """Subtract L X from the blocks of all pairs of nodes that node k couples."""
    first, last, pair = P.next_first[k], P.next_first[k + 1], P.pair_first[k]
    for p in range(first, last):
        for i in range(P.size[P.next[p]]):
            row_times(L[P.shift[p] + i], X, spare)
            for q in range(first, last):
                to = P.target[pair + q - first] + i * P.stride[pair + q - first]
                at = P.shift[q]
                for j in range(P.size[P.next[q]]):
                    F[to + j] -= spare[at + j]
        pair += last - first


@inner
def row_times(l, X, out):
    """Set out to l X; rows of X that l does not touch are left alone, four are taken at a time."""
    d, c = X.shape
    for j in range(c):
        out[j] = 0.0
    t = 0
    while t + 3 < d:
        a0, a1, a2, a3 = l[t], l[t + 1], l[t + 2], l[t + 3]
        if a0 != 0.0 or a1 != 0.0 or a2 != 0.0 or a3 != 0.0:
            for j in range(c):
                out[j] += a0 * X[t, j] + a1 * X[t + 1, j] + a2 * X[t + 2, j] + a3 * X[t + 3, j]
        t += 4
    while t < d:
        a0 = l[t]
        for j in range(c):
            out[j] += a0 * X[t, j]
        t += 1


@inner
def substitute(P, F, pivot, x, y):
    """Solve in place for x with the factors of `eliminate`; y (n + m,) is working memory."""
    for i in range(y.size):
        y[P.position[i]] = x[i]
    for k in range(P.size.size):
        d, at, L = P.size[k], P.start[k], P.below[k]
        A = F[P.pivot[k] : P.pivot[k] + d * d].reshape((d, d))
        back_substitute(A, d, pivot[at : at + d], y[at : at + d])
        for p in range(P.next_first[k], P.next_first[k + 1]):
            to = P.start[P.next[p]]
            for i in range(P.size[P.next[p]]):
                row, total = L + (P.shift[p] + i) * d, 0.0
                for j in range(d):
                    total += F[row + j] * y[at + j]
                y[to + i] -= total
    for k in range(P.size.size - 1, -1, -1):
        c, at, X = P.wide[k], P.start[k], P.right[k]
        for p in range(P.next_first[k], P.next_first[k + 1]):
            first = P.start[P.next[p]]
            for i in range(P.size[k]):
                row, total = X + i * c + P.shift[p], 0.0
                for j in range(P.size[P.next[p]]):
                    total += F[row + j] * y[first + j]
                y[at + i] -= total
    for i in range(y.size):
        x[i] = y[P.position[i]]


def may_repeat_constraints(system):
    """Whether constraints may depend on each other."""
    return not system.graph.compact or system.graph.shares


def _shares_in_blocks(system):
    return system.graph.compact and system.graph.shares


@stage(types.void, System, Work, types.int64, REAL_MATRIX, needed=lambda s: not s.graph.compact)
def constraint_range(s, W, rank, U):
    """Set the leading rows of U (rank, m) to an orthonormal basis of the range of W.G."""
    range_basis(W.G, rank, W.remainder, U)


@inner
def border(W, rank):
    """Project the constraint gradient on the range W.U_lu: W.UG, and its copy W.UGT."""
    m, wide = W.G.shape
    for k in range(rank):
        for j in range(wide):
            W.UG[k, j] = W.G[k, j] if rank == m else 0.0
        if rank < m:
            for p in range(m):
                u = W.U_lu[k, p]
                for j in range(wide):
                    W.UG[k, j] += u * W.G[p, j]
        for j in range(wide):
            W.UGT[k, j] = W.UG[k, j]


@inner
def set_scaling(s, W, rank):
    """Scales with which masses and gradients have size one."""
    bodies, graph, d, n = s.bodies, s.graph, W.scaling, W.residual.size
    for b in range(bodies.mass.size):
        x, y = own_corner(s, b)
        for i in range(6 + bodies.r[b]):
            mass = W.S[x + i, y + i]
            d[bodies.v_at[b] + i] = 1.0 / math.sqrt(mass) if mass > 0.0 else 1.0
    for k in range(rank):
        total = 0.0
        for j in range(0 if graph.compact else n):
            total += (W.UG[k, j] * d[j]) ** 2
        for p in range(4 if graph.compact else 0):
            b = graph.body[k, p]
            for q in range(6 + bodies.r[b] if b >= 0 else 0):
                total += (W.UG[k, graph.at[k, p] + q] * d[bodies.v_at[b] + q]) ** 2
        d[n + k] = 1.0 / math.sqrt(total) if total > 0.0 else 1.0
    if graph.shares != 0:
        set_softness(W, n, rank)


@inner
def set_softness(W, n, rank):
    """Softness of each constraint: multipliers that nothing decides get the least norm."""
    most = 0.0
    for k in range(rank):
        most = max(most, W.scaling[n + k] ** 2)
    for k in range(rank):
        W.soft[k] = max(MIN_SOFTNESS, MAX_SOFTNESS * W.scaling[n + k] ** 2 / most)


@inner
def fill(W, rank):
    """Write [S, UG^T; UGT, 0], scaled, into W.lu from whole matrices."""
    n, d = W.residual.size, W.scaling
    for i in range(n):
        for j in range(n):
            W.lu[i, j] = W.S[i, j] * d[i] * d[j]
    for k in range(rank):
        for l in range(rank):
            W.lu[n + k, n + l] = 0.0
        for j in range(n):
            W.lu[n + k, j] = W.UGT[k, j] * d[n + k] * d[j]
            W.lu[j, n + k] = W.UG[k, j] * d[n + k] * d[j]


def _has_blocks(system):
    return system.graph.compact


@stage(types.void, System, Work, needed=_has_blocks)
def fill_from_blocks(s, W):
    """The same from blocks."""
    bodies, graph, n, d = s.bodies, s.graph, W.residual.size, W.scaling
    W.lu[:] = 0.0
    for b in range(bodies.mass.size):
        for e in range(graph.first[b], graph.first[b + 1]):
            t, u = bodies.v_at[b], bodies.v_at[graph.other[e]]
            for i in range(6 + bodies.r[b]):
                for j in range(6 + bodies.r[graph.other[e]]):
                    W.lu[t + i, u + j] = W.S[graph.x[e] + i, graph.y[e] + j] * d[t + i] * d[u + j]
    for k in range(s.rows.kind.size):
        for p in range(4):
            b = graph.body[k, p]
            for q in range(6 + bodies.r[b] if b >= 0 else 0):
                j = bodies.v_at[b] + q
                W.lu[n + k, j] = W.UGT[k, graph.at[k, p] + q] * d[n + k] * d[j]
                W.lu[j, n + k] = W.UG[k, graph.at[k, p] + q] * d[n + k] * d[j]


@stage(types.boolean, System, Work, needed=_has_blocks)
def factorise_blocks(s, W):
    """Factorise [S, UG^T; UGT, 0] by blocks; False when a node has no safe pivot."""
    fill_blocks(s, W)
    return eliminate(s.graph.plan, W.factor, W.pivot, W.spare)


@stage(types.void, System, Work, needed=_has_blocks)
def solve_blocks(s, W):
    """Solve in place for W.rhs, factorised by blocks before."""
    substitute(s.graph.plan, W.factor, W.pivot, W.rhs, W.spare)


@stage(types.void, System, Work, needed=_shares_in_blocks)
def solve_sharing(s, W):
    """The same where constraints may repeat others: exact ones, and multipliers of least norm.

    Constraints gave way by their softness E times their multipliers. Two more solutions for what
    this left, -E lam, take the motions x to those of constraints that do not; of the multipliers
    they repeat the part n that nothing decides: lam_1 = r_1 + n, lam_2 = r_2 + n, lam_3 = n, and
    r_1 + r_2 is wanted.
    """
    n = W.residual.size
    solve_blocks(s, W)
    for turn in range(2):
        for i in range(W.rhs.size):
            W.refined[turn, i] = W.rhs[i]
            W.rhs[i] = 0.0 if i < n else -W.soft[i - n] * W.rhs[i]
        solve_blocks(s, W)
    for i in range(W.rhs.size):
        third = W.rhs[i] if i < n else -2.0 * W.rhs[i]
        W.rhs[i] = W.refined[0, i] + W.refined[1, i] + third


@stage(types.void, System, Work, REAL_VECTOR, needed=_shares_in_blocks)
def remove_undecided(s, W, lam):
    """Take from multipliers lam (m,) what does nothing; `factorise_bordered` before."""
    n = W.residual.size
    for i in range(n):
        W.rhs[i] = 0.0
    for k in range(lam.size):
        W.rhs[n + k] = -W.soft[k] * lam[k] / W.scaling[n + k]
    for turn in range(2):
        solve_blocks(s, W)
        for i in range(n if turn == 0 else 0):
            W.rhs[i] = 0.0
        for k in range(lam.size if turn == 0 else 0):
            W.rhs[n + k] *= -W.soft[k]
    for k in range(lam.size):
        lam[k] -= W.rhs[n + k] * W.scaling[n + k]


@stage(types.boolean, System, Work, types.int64)
def factorise_bordered(s, W, rank):
    """Factorise [S, UG^T; UGT, 0]; False when it is singular."""
    n = W.residual.size
    set_scaling(s, W, rank)
    W.by_blocks[0] = s.graph.compact
    if s.graph.compact:
        if factorise_blocks(s, W):
            return True
        if W.lu.shape[0] < n + rank or s.graph.shares != 0:
            return False
        W.by_blocks[0] = 0
        fill_from_blocks(s, W)
    else:
        fill(W, rank)
    return factorise(W.lu, n + rank, W.pivot)


@stage(types.void, System, Work, types.int64, REAL_VECTOR, REAL_VECTOR)
def solve_bordered(s, W, rank, x, lam):
    """Solve for x (n,) and lam (m,); W.rhs[:n] and W.part (m,) hold the right-hand side."""
    m, n = W.G.shape[0], W.residual.size
    for i in range(n):
        W.rhs[i] *= W.scaling[i]
    for k in range(rank):
        total = W.part[k]
        if rank < m:
            total = 0.0
            for p in range(m):
                total += W.U_lu[k, p] * W.part[p]
        W.rhs[n + k] = total * W.scaling[n + k]
    if W.by_blocks[0] and s.graph.shares != 0:
        solve_sharing(s, W)
    elif W.by_blocks[0]:
        solve_blocks(s, W)
    else:
        back_substitute(W.lu, n + rank, W.pivot, W.rhs)
    for i in range(n):
        x[i] = W.rhs[i] * W.scaling[i]
    for p in range(m):
        lam[p] = W.rhs[n + p] * W.scaling[n + p] if rank == m else 0.0
        if rank < m:
            for k in range(rank):
                lam[p] += W.U_lu[k, p] * W.scaling[n + k] * W.rhs[n + k]


@stage(types.void, System, Work, REAL_VECTOR, types.boolean, REAL_VECTOR)
def gradient_times(s, W, x, absolute, out):
    """Set out (m,) to G x, or to the sums of absolute values, G as last evaluated."""
    graph = s.graph
    for k in range(s.rows.kind.size):
        out[k] = 0.0
        for p in range(4):
            b = graph.body[k, p]
            for q in range(6 + s.bodies.r[b] if b >= 0 else 0):
                term = W.G[k, graph.at[k, p] + q] * x[s.bodies.v_at[b] + q]
                out[k] += abs(term) if absolute else term
