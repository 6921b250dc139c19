"""Compiled elimination of blocks, leaf to root: linear cost for chains and trees of bodies.

With A = [A_kk R; B C], node k leaves R replaced by X = A_kk^-1 R and C by C - B X. For a tree
whose joints follow their outer body this is the recursion of the articulated inertias, and C gets
no new blocks; closed loops and forces between distant bodies add blocks along the way.

Source:
    Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 7, and sections 6.5 and 8.
"""

from rom.mbs.kernels.algebra import factorise
from rom.mbs.kernels.compiled import inner

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
            subtract_row(A[i, k], X, k, i)
    for i in range(d - 1, -1, -1):
        for k in range(i + 1, d):
            subtract_row(A[i, k], X, k, i)
        f = 1.0 / A[i, i]
        for j in range(c):
            X[i, j] *= f


@inner
def subtract_row(f, X, k, i):
    """Subtract f times row k of X from row i."""
    if f != 0.0:
        for j in range(X.shape[1]):
            X[i, j] -= f * X[k, j]


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
        back(F, P.pivot[k], d, pivot, at, y)
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


@inner
def back(F, A, d, pivot, at, y):
    """Replace y[at:at+d] by the solution with the factorised node at F[A:A+d*d]."""
    for k in range(d):
        p = pivot[at + k]
        if p != k:
            y[at + k], y[at + p] = y[at + p], y[at + k]
    for i in range(d):
        total = y[at + i]
        for j in range(i):
            total -= F[A + i * d + j] * y[at + j]
        y[at + i] = total
    for i in range(d - 1, -1, -1):
        total = y[at + i]
        for j in range(i + 1, d):
            total -= F[A + i * d + j] * y[at + j]
        y[at + i] = total / F[A + i * d + i]
