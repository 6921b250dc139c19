"""Discontinuous deformation analysis: blocks in contact, one implicit step after the other.

Corners of one block touch edges of another one; a closed contact is a stiff spring along
the normal of the edge and, while it sticks, one along it. Which contacts are closed, stick or slip
is found by open-close iteration within each step. Time runs by Newmark's scheme with beta = 1/2 and
gamma = 1, which is exact for constant forces and damps vibrations by 1 / sqrt(1 + (omega h)^2 / 2)
a step. Gyroscopic terms of the deformation are neglected, as usual.

Source:
    After Shi (1988). Different here: elastic shapes live in body axes, stick and slip follow by
    return mapping, friction is solved with the normal forces that it follows, and contacts open by
    force, since a tolerance of the gap would carry tension.
"""

import math
from typing import NamedTuple

import numpy as np

from rom.components.masonry.block_contact import OPEN, SLIDES, STICKS, Blocks, find_contacts
from rom.mbs.kernels.compiled import inner, kernel
from rom.model import Array, Index

STATE_CHANGES = 12  # open-close iterations before the step is cut
STEP_FACTOR, MIN_STEP_RATIO = 3.0, 3.0**-8


class Drive(NamedTuple):
    """What acts from outside in each of n steps, besides weight."""

    block: Index  # (n, L) block each force acts on; -1 for none
    corner: Index  # (n, L, 3) corners of it that the point of action lies between
    share: Array  # (n, L, 3) their shares in it
    force: Array  # (n, L, 2) [N]
    turns: Index  # (L,) 1 where the force turns with the block
    ground: Array  # (n, 2) acceleration of the frame of reference [m/s^2]
    moved: Array  # (n, B, 3) by how much held blocks are moved [m, m, rad]


class Work(NamedTuple):
    """Memory of a step: corners P and their Jacobians T, loads, the equations, the solution.

    A is the lower triangle of the equations, U the upper one, transposed.
    """

    P: Array
    T: Array
    A: Array
    U: Array
    left: Index
    rhs: Array
    d: Array
    q: Array
    v: Array
    load: Array


def work(B: Blocks) -> Work:
    """Memory for steps of these blocks."""
    V, (b, m) = len(B.corner), B.load.shape
    n = int(B.size[B.equation >= 0].sum())
    P, T, A, U = (np.zeros(shape) for shape in ((V, 2), (V, 2, m), (n, n), (n, n)))
    d, q, v, load = np.zeros((4, b, m))
    return Work(P, T, A, U, np.zeros(n, dtype=np.int64), np.zeros(n), d, q, v, load)


@inner
def envelope(B, C, left):
    """First column of each row that closed contacts or the block itself fill."""
    for b in range(B.size.size):
        for p in range(B.size[b] if B.equation[b] >= 0 else 0):
            left[B.equation[b] + p] = B.equation[b]
    for k in range(C.used[0]):
        i, j = B.equation[C.who[k, 0]], B.equation[C.who[k, 2]]
        if i >= 0 and j >= 0 and C.state[k] != OPEN:
            for p in range(B.size[C.who[k, 0]] if i > j else B.size[C.who[k, 2]]):
                row = max(i, j) + p
                left[row] = min(left[row], min(i, j))


@inner
def assemble(B, law, C, h, W):
    """Set 2 M / h^2 + K + contact springs, row by row from W.left; True if it is symmetric.

    Friction of sliding contacts follows their normal forces, which is not; then W.U is set, too.
    """
    envelope(B, C, W.left)
    for row in range(W.left.size):
        W.A[row, W.left[row] : row + 1] = 0.0
    for b in range(B.size.size):
        at = B.equation[b]
        for p in range(B.size[b] if at >= 0 else 0):
            for r in range(p + 1):
                W.A[at + p, at + r] += 2 * B.M[b, p, r] / (h * h) + B.K[b, p, r]
    n_sliding = 0
    for k in range(C.used[0]):
        if C.state[k] != OPEN:
            add_product(B, C.who[k], C.n[k], C.n[k], law.normal, W.A)
        if C.state[k] == STICKS:
            add_product(B, C.who[k], C.t[k], C.t[k], law.shear, W.A)
        n_sliding += C.state[k] == SLIDES
    if n_sliding == 0:
        return True
    add_friction(B, law, C, W)
    return False


@inner
def add_friction(B, law, C, W):
    """Set W.U to the symmetric part, and add to both triangles what drags sliding contacts."""
    for row in range(W.left.size):
        for column in range(W.left[row], row + 1):
            W.U[row, column] = W.A[row, column]
    for k in range(C.used[0]):
        if C.state[k] == SLIDES:
            drag = -C.way[k] * C.friction[k] * law.normal
            add_product(B, C.who[k], C.t[k], C.n[k], drag, W.A)
            add_product(B, C.who[k], C.n[k], C.t[k], drag, W.U)


@inner
def add_product(B, who, g, f, factor, A):
    """Add factor g f^T to the lower triangle."""
    for one in range(2):
        for other in range(2):
            at, to = B.equation[who[2 * one]], B.equation[who[2 * other]]
            if at < to or to < 0:
                continue
            for p in range(B.size[who[2 * one]]):
                for r in range(p + 1 if at == to else B.size[who[2 * other]]):
                    A[at + p, to + r] += factor * g[one, p] * f[other, r]


@inner
def eliminate(L, U, left, i):
    """Row i of a triangular factor, left of its diagonal, from its earlier rows and those of U."""
    for j in range(left[i], i):
        low = max(left[i], left[j])
        row, column = L[i, low:j], U[j, low:j]
        total = L[i, j]
        for k in range(row.size):
            total -= row[k] * column[k]
        L[i, j] = total / U[j, j]


@inner
def factorise(L, U, left, symmetric):
    """Triangular factors in place, their diagonals equal but for signs; U is transposed.

    Large friction makes pivots negative without making states wrong. False if one vanishes, or is
    negative where equations are symmetric and L is handed over as U.
    """
    for i in range(left.size):
        eliminate(L, U, left, i)
        if not symmetric:
            eliminate(U, L, left, i)
        pivot = L[i, i]
        for k in range(left[i], i):
            pivot -= L[i, k] * U[i, k]
        if not (pivot > 0.0 or (pivot < 0.0 and not symmetric)):
            return False
        L[i, i] = math.sqrt(abs(pivot))
        U[i, i] = math.copysign(L[i, i], pivot)
    return True


@inner
def solve(L, U, left, x):
    """Solve with the factors, in place."""
    n = left.size
    for i in range(n):
        total = x[i]
        for k in range(left[i], i):
            total -= L[i, k] * x[k]
        x[i] = total / L[i, i]
    for i in range(n - 1, -1, -1):
        x[i] /= U[i, i]
        for k in range(left[i], i):
            x[k] -= U[i, k] * x[i]


@inner
def set_loads(B, drive, n, W):
    """Set W.load: weight in the moved frame, and the forces of step n where blocks are now."""
    for b in range(B.size.size):
        for p in range(B.size[b]):
            W.load[b, p] = B.load[b, p]
            if p < 2:
                W.load[b, p] -= B.M[b, p, p] * drive.ground[n, p]
    for l in range(drive.turns.size):
        b, x, y = drive.block[n, l], drive.force[n, l, 0], drive.force[n, l, 1]
        if b < 0:
            continue
        if drive.turns[l] == 1:
            c, s = math.cos(W.q[b, 2]), math.sin(W.q[b, 2])
            x, y = c * x - s * y, s * x + c * y
        for e in range(3):
            a, w = drive.corner[n, l, e], drive.share[n, l, e]
            for p in range(B.size[b]):
                W.load[b, p] += w * (W.T[a, 0, p] * x + W.T[a, 1, p] * y)


@inner
def set_held(B, drive, n, part, W):
    """Set W.d of held blocks: their share in the motion of step n."""
    for b in range(B.size.size):
        for p in range(3 if B.equation[b] < 0 else 0):
            W.d[b, p] = part * drive.moved[n, b, p]


@inner
def change(B, C, k, g, d, held):
    """Gap or slip gained over the step: gradient g times increments; ``held``: of held blocks."""
    total = 0.0
    for one in range(2):
        b = C.who[k, 2 * one]
        if held and B.equation[b] >= 0:
            continue
        for p in range(B.size[b]):
            total += g[k, one, p] * d[b, p]
    return total


@inner
def right_hand_side(B, law, C, h, W):
    """Set W.rhs: momentum, loads, elastic forces, springs and friction at the start of the step."""
    for b in range(B.size.size):
        at = B.equation[b]
        for p in range(B.size[b] if at >= 0 else 0):
            total = W.load[b, p]
            for r in range(B.size[b]):
                total += 2 * B.M[b, p, r] * W.v[b, r] / h - B.K[b, p, r] * W.q[b, r]
            W.rhs[at + p] = total
    for k in range(C.used[0]):
        if C.state[k] == OPEN:
            continue
        normal_force = -law.normal * (C.gap[k] + change(B, C, k, C.n, W.d, held=True))
        drag = -law.shear * (C.slip[k] + change(B, C, k, C.t, W.d, held=True))
        if C.state[k] == SLIDES:
            drag = -C.way[k] * C.friction[k] * normal_force
        for one in range(2):
            b = C.who[k, 2 * one]
            for p in range(B.size[b] if B.equation[b] >= 0 else 0):
                W.rhs[B.equation[b] + p] += normal_force * C.n[k, one, p] + drag * C.t[k, one, p]


@inner
def review(B, law, C, d):
    """States and normal forces at the end of the step; 0 if none has changed, or a sum of them."""
    changed, code = False, 1
    for k in range(C.used[0]):
        force = -law.normal * (C.gap[k] + change(B, C, k, C.n, d, held=False))
        trial = law.shear * (C.slip[k] + change(B, C, k, C.t, d, held=False))
        state, pull, cohesion = STICKS, 0.0, 0.0
        if C.bond[k] >= 0 and C.state[k] == STICKS:
            pull, cohesion = law.bonds.pull[C.bond[k]], law.bonds.cohesion[C.bond[k]]
        if force < (law.tension if C.state[k] == OPEN else -law.tension - pull):
            state = OPEN
        elif abs(trial) > max(C.friction[k] * force + cohesion, 0.0) + law.tension:
            state = SLIDES
        direction, pressed = math.copysign(1.0, trial), max(force, 0.0)
        if state == SLIDES and C.state[k] == SLIDES and direction != C.way[k]:
            state = STICKS  # what would turn back within the step comes to rest in between
        if state == STICKS and C.bond[k] >= 0:
            pressed = force
        if state != C.state[k] or (state == SLIDES and direction != C.way[k]):
            changed = True
        C.state[k], C.way[k], C.force[k] = state, direction, pressed
        code = 31 * code + 3 * state + (state == SLIDES and direction > 0.0)
    return 2 * code + 1 if changed else 0


@inner
def step(B, law, C, h, W):
    """Open-close iteration for the increments W.d over h; False if it does not settle.

    It does not where a contact with much friction neither sticks nor slips in steps of h: forces
    beyond friction let it slip, the pressure that slipping brings lets it stick, in turns.
    """
    last = earlier = 0
    for _ in range(STATE_CHANGES + 1):
        symmetric = assemble(B, law, C, h, W)
        U = W.A if symmetric else W.U
        if not factorise(W.A, U, W.left, symmetric):
            return False
        right_hand_side(B, law, C, h, W)
        solve(W.A, U, W.left, W.rhs)
        farthest = 0.0
        for b in range(B.size.size):
            for p in range(B.size[b] if B.equation[b] >= 0 else 0):
                W.d[b, p] = W.rhs[B.equation[b] + p]
            for a in range(B.first[b], B.first[b + 1]):
                for axis in range(2):
                    displacement = 0.0
                    for p in range(B.size[b]):
                        displacement += W.T[a, axis, p] * W.d[b, p]
                    farthest = max(farthest, abs(displacement))
        found = review(B, law, C, W.d)
        if found == 0:
            return farthest < 0.5 * law.reach
        if found == earlier:
            return False
        earlier, last = last, found
    return False


@inner
def accept(B, law, C, h, damping, W):
    """Move on by W.d: coordinates, velocities that die away, anchors of what slipped, bonds."""
    kept = math.exp(-damping * h)
    for k in range(C.used[0]):
        if C.bond[k] >= 0 and C.state[k] != STICKS:
            law.bonds.intact[C.bond[k]] = 0
        if C.state[k] == SLIDES:
            end = C.along[k, 0] + change(B, C, k, C.t, W.d, held=False) / C.along[k, 3]
            stretch = C.way[k] * C.friction[k] * C.force[k] / law.shear
            C.anchor[k] = end - stretch / C.along[k, 3]
    for b in range(B.size.size):
        for p in range(B.size[b] if B.equation[b] >= 0 else 0):
            W.q[b, p] += W.d[b, p]
            W.v[b, p] = kept * (2 * W.d[b, p] / h - W.v[b, p])
        for p in range(3 if B.equation[b] < 0 else 0):
            W.q[b, p] += W.d[b, p]
            W.v[b, p] = W.d[b, p] / h


@inner
def energy(B, law, C, W):
    """Kinetic, elastic and potential energy, with that of the contact springs."""
    total = 0.0
    for b in range(B.size.size):
        for p in range(B.size[b]):
            total -= B.load[b, p] * W.q[b, p]
            for r in range(B.size[b]):
                total += 0.5 * W.v[b, p] * B.M[b, p, r] * W.v[b, r]
                total += 0.5 * W.q[b, p] * B.K[b, p, r] * W.q[b, r]
    for k in range(C.used[0]):
        if C.state[k] != OPEN:
            total += 0.5 * C.force[k] ** 2 / law.normal
        if C.state[k] == SLIDES:
            total += 0.5 * (C.friction[k] * C.force[k]) ** 2 / law.shear
        if C.state[k] == STICKS:
            total += 0.5 * law.shear * (C.slip[k] + change(B, C, k, C.t, W.d, held=False)) ** 2
    return total


@inner
def remember(C, old):
    """Copy what the next list of contacts takes over."""
    old.used[0] = C.used[0]
    for b in range(C.first.size):
        old.first[b] = C.first[b]
    for k in range(C.used[0]):
        for p in range(5):
            old.who[k, p] = C.who[k, p]
        old.state[k], old.anchor[k] = C.state[k], C.anchor[k]
        old.way[k], old.force[k] = C.way[k], C.force[k]


@kernel
def advance(B, law, C, old, W, h, drive, damping, cuts):  # noqa: PLR0913  all there is
    """Make the steps of a drive from W.q, W.v; the energy at the end, NaN if one cannot be made.

    Steps that do not settle are cut by three, down to h / 3^8; ``cuts`` (1,) counts them.
    """
    for n in range(len(drive.ground)):
        done, part = 0.0, h
        while done < h * (1 - 1e-9):
            part = min(part, h - done)
            remember(C, old)
            find_contacts(B, law, W.q, old, C, W.P, W.T)
            set_loads(B, drive, n, W)
            set_held(B, drive, n, part / h, W)
            while not step(B, law, C, part, W):
                part /= STEP_FACTOR
                cuts[0] += 1
                if part < MIN_STEP_RATIO * h:
                    return math.nan
                find_contacts(B, law, W.q, old, C, W.P, W.T)
                set_held(B, drive, n, part / h, W)
            accept(B, law, C, part, damping, W)
            done += part
            part *= STEP_FACTOR
    return energy(B, law, C, W)
