"""Corners that touch edges: positions, the list of contacts, gradients of gap and slip.

A block moves as x = c + A (X + sum phi_k q_k): its frame, and elastic shapes that carry no linear
momentum. Its edges stay straight between their corners.
"""

import math
from typing import NamedTuple

import numpy as np

from rom.mbs.kernels.compiled import inner, kernel
from rom.model import Array, Index

OPEN, SLIDES, STICKS = 0, 1, 2
ADMITTED = -math.sin(math.radians(3.0))  # edges of a corner may dive so far below an edge it meets
# of the edge's length: distance beyond its end at which corners still touch
EDGE_OVERHANG_RTOL = 1e-4


class Blocks(NamedTuple):
    """What does not change; R is the largest number of shapes."""

    first: Index  # (B + 1,) first corner of each block
    corner: Array  # (V, 2) corners from the mass centre in body axes, counterclockwise [m]
    shape: Array  # (V, 2, R) displacement of the corners per elastic coordinate, body axes
    size: Index  # (B,) number of coordinates, 3 + r
    equation: Index  # (B,) number of the first equation; -1 for a block that is held
    M: Array  # (B, 3 + R, 3 + R) mass
    K: Array  # (B, 3 + R, 3 + R) stiffness, zero for the frame
    load: Array  # (B, 3 + R) constant load [N]


class Bonds(NamedTuple):
    """Corners glued to edges."""

    who: Index  # (n, 5) as in `Contacts`
    pull: Array  # (n,) tension they bear [N]
    cohesion: Array  # (n,) shear they bear without pressure [N]
    intact: Index  # (n,) 1 until they break


class Law(NamedTuple):
    """Contact: stiffness [N/m] along normal and edge, tension lost in round-off [N].

    ``reach`` [m] is how near a corner must be to an edge to be watched, ``friction`` (B, B) that of
    each pair of blocks.
    """

    normal: float
    shear: float
    tension: float
    reach: float
    friction: Array
    bonds: Bonds


class Contacts(NamedTuple):
    """Corners that are near edges, bonds first, then block by block."""

    used: Index  # (1,) how many rows are in use
    who: Index  # (C, 5) block and corner, block and both corners of the edge
    state: Index  # (C,) OPEN, SLIDES or STICKS
    anchor: Array  # (C,) place on the edge, 0 to 1, that the corner sticks to
    way: Array  # (C,) direction of slip along the edge, -1 or 1
    gap: Array  # (C,) distance from the edge [m]
    slip: Array  # (C,) distance from the anchor along the edge [m]
    force: Array  # (C,) normal force [N]
    friction: Array  # (C,) coefficient of friction
    bond: Index  # (C,) number of the bond; -1 for none
    along: Array  # (C, 4) place of the corner on the edge, 0 to 1, normal and length of the edge
    n: Array  # (C, 2, 3 + R) gap per coordinate of both blocks
    t: Array  # (C, 2, 3 + R) slip likewise
    first: Index  # (B + 1,) first contact, after the bonds, of the corners of each block
    box: Array  # (B, 2, 2) smallest and largest x and y of each block [m]


def contacts(capacity: int, m: int, n_blocks: int) -> Contacts:
    """Room for contacts of blocks with at most m coordinates."""
    sizes = 1, (capacity, 5), capacity, capacity, n_blocks + 1
    used, who, state, bond, first = (np.zeros(size, dtype=np.int64) for size in sizes)
    along, n, t = (np.zeros((capacity, *shape)) for shape in ((4,), (2, m), (2, m)))
    numbers = np.zeros((6, capacity))  # from anchor to friction
    box = np.zeros((n_blocks, 2, 2))
    return Contacts._make([used, who, state, *numbers, bond, along, n, t, first, box])


@inner
def place_corners(B, q, P, T):
    """Positions of all corners, and their velocity per rate of the coordinates of their block."""
    for b in range(B.size.size):
        c, s = math.cos(q[b, 2]), math.sin(q[b, 2])
        for a in range(B.first[b], B.first[b + 1]):
            x, y = B.corner[a, 0], B.corner[a, 1]
            for k in range(B.size[b] - 3):
                x += B.shape[a, 0, k] * q[b, 3 + k]
                y += B.shape[a, 1, k] * q[b, 3 + k]
                T[a, 0, 3 + k] = c * B.shape[a, 0, k] - s * B.shape[a, 1, k]
                T[a, 1, 3 + k] = s * B.shape[a, 0, k] + c * B.shape[a, 1, k]
            X, Y = c * x - s * y, s * x + c * y
            P[a, 0], P[a, 1] = q[b, 0] + X, q[b, 1] + Y
            T[a, 0, 0], T[a, 1, 0], T[a, 0, 1], T[a, 1, 1] = 1.0, 0.0, 0.0, 1.0
            T[a, 0, 2], T[a, 1, 2] = -Y, X


@inner
def place_boxes(B, P, box):
    """Boxes around the blocks."""
    for b in range(B.size.size):
        for axis in range(2):
            low = high = P[B.first[b], axis]
            for a in range(B.first[b] + 1, B.first[b + 1]):
                low, high = min(low, P[a, axis]), max(high, P[a, axis])
            box[b, axis, 0], box[b, axis, 1] = low, high


@inner
def near(box, i, j, reach):
    """Whether the boxes around two blocks are within reach of each other."""
    for axis in range(2):
        if box[i, axis, 0] > box[j, axis, 1] + reach or box[j, axis, 0] > box[i, axis, 1] + reach:
            return False
    return True


@inner
def outside(box, j, x, y, reach):
    """Whether a point is too far from the box around block j to meet an edge of it."""
    over = EDGE_OVERHANG_RTOL * (box[j, 0, 1] - box[j, 0, 0] + box[j, 1, 1] - box[j, 1, 0])
    over += reach
    if x < box[j, 0, 0] - over or x > box[j, 0, 1] + over:
        return True
    return y < box[j, 1, 0] - over or y > box[j, 1, 1] + over


@inner
def around(B, b, a, step):
    """The corner of block b before or after corner a."""
    low, high = B.first[b], B.first[b + 1]
    return low + (a - low + step) % (high - low)


@inner
def faces(B, P, i, a, nx, ny):
    """Whether both edges at corner a of block i lead away from an edge with this normal."""
    for step in (-1, 1):
        o = around(B, i, a, step)
        x, y = P[o, 0] - P[a, 0], P[o, 1] - P[a, 1]
        if x * nx + y * ny < ADMITTED * math.hypot(x, y):
            return False
    return True


@inner
def nearest_edge(B, P, i, a, j, reach):
    """First corner of the edge of block j that corner a meets, and gap, place, normal; -1: none.

    Of several edges the one with the largest gap: out of a convex block the shortest way leads
    through it.
    """
    found, gap, way, nx, ny = -1, -reach, 0.0, 0.0, 0.0
    for c in range(B.first[j], B.first[j + 1]):
        o = around(B, j, c, 1)
        x, y = P[o, 0] - P[c, 0], P[o, 1] - P[c, 1]
        l = math.hypot(x, y)
        px, py = P[a, 0] - P[c, 0], P[a, 1] - P[c, 1]
        w, g = (px * x + py * y) / (l * l), (px * y - py * x) / l
        if abs(g) >= reach or g <= gap or w < -EDGE_OVERHANG_RTOL or w > 1 + EDGE_OVERHANG_RTOL:
            continue
        if faces(B, P, i, a, y / l, -x / l):
            found, gap, way, nx, ny = c, g, w, y / l, -x / l
    return found, gap, way, nx, ny


@inner
def list_bonds(law, P, C):
    """List the bonds that hold, wherever their corners are."""
    for n in range(law.bonds.intact.size):
        if law.bonds.intact[n] == 1:
            k, a = C.used[0], law.bonds.who[n, 1]
            c, o = law.bonds.who[n, 3], law.bonds.who[n, 4]
            x, y = P[o, 0] - P[c, 0], P[o, 1] - P[c, 1]
            l = math.hypot(x, y)
            px, py = P[a, 0] - P[c, 0], P[a, 1] - P[c, 1]
            for p in range(5):
                C.who[k, p] = law.bonds.who[n, p]
            C.gap[k], C.bond[k] = (px * y - py * x) / l, n
            C.along[k, 0], C.along[k, 1], C.along[k, 2] = (px * x + py * y) / (l * l), y / l, -x / l
            C.used[0] = k + 1


@inner
def glued(C, n_bonds, a, j):
    """Whether corner a is glued to an edge of block j; bonds are the first contacts."""
    for k in range(n_bonds):
        if C.who[k, 1] == a and C.who[k, 2] == j:
            return True
    return False


@inner
def list_corners(B, law, P, C, i, j):
    """List the corners of block i that meet an edge of block j and are not glued to it."""
    for a in range(B.first[i], B.first[i + 1]):
        if outside(C.box, j, P[a, 0], P[a, 1], law.reach):
            continue
        c, gap, w, nx, ny = nearest_edge(B, P, i, a, j, law.reach)
        k = C.used[0]
        if c >= 0 and k < C.state.size and not glued(C, C.first[0], a, j):
            C.bond[k] = -1
            C.who[k, 0], C.who[k, 1], C.who[k, 2] = i, a, j
            C.who[k, 3], C.who[k, 4] = c, around(B, j, c, 1)
            C.gap[k], C.along[k, 0], C.along[k, 1], C.along[k, 2] = gap, w, nx, ny
            C.used[0] = k + 1


@inner
def detect(B, law, P, old, C):
    """List the contacts of the blocks as they lie; what an old contact remembers is kept."""
    C.used[0] = 0
    list_bonds(law, P, C)
    place_boxes(B, P, C.box)
    for i in range(B.size.size):
        C.first[i] = C.used[0]
        for j in range(B.size.size):
            if i == j or (B.equation[i] < 0 and B.equation[j] < 0):
                continue
            if near(C.box, i, j, law.reach):
                list_corners(B, law, P, C, i, j)
    C.first[B.size.size] = C.used[0]
    drop_doubles(C, P, law.reach)
    for k in range(C.used[0]):
        i = C.who[k, 0]
        C.friction[k] = law.friction[i, C.who[k, 2]]
        C.state[k] = STICKS if C.bond[k] >= 0 else OPEN
        C.anchor[k], C.way[k], C.force[k] = C.along[k, 0], 0.0, 0.0
        recall(C, k, old, 0, old.first[0])
        recall(C, k, old, old.first[i], old.first[i + 1])


@inner
def recall(C, k, old, first, last):
    """Take over what the same contact, one of a range of old ones, remembers."""
    for o in range(first, last):
        if old.who[o, 1] == C.who[k, 1] and old.who[o, 3] == C.who[k, 3]:
            C.state[k], C.way[k], C.force[k] = old.state[o], old.way[o], old.force[o]
            if old.state[o] != OPEN:
                C.anchor[k] = old.anchor[o]


@inner
def parted(C, P, reach, k, first, last):
    """Whether one of a range of contacts, its corners met the other way round, goes before k."""
    for o in range(first, last):
        if C.who[o, 0] != C.who[k, 2] or C.who[o, 2] != C.who[k, 0]:
            continue
        a, c = C.who[k, 1], C.who[o, 1]
        apart = math.hypot(P[a, 0] - P[c, 0], P[a, 1] - P[c, 1])
        dot = C.along[k, 1] * C.along[o, 1] + C.along[k, 2] * C.along[o, 2]
        if apart < reach and dot > -0.5:
            larger = C.gap[k] < C.gap[o] or (C.gap[k] == C.gap[o] and k > o)
            if C.bond[o] >= 0 or larger:
                return True
    return False


@inner
def drop_doubles(C, P, reach):
    """Where two corners meet, let only the edge with the larger gap, or glue, part the blocks."""
    for k in range(C.first[0], C.used[0]):
        j = C.who[k, 2]
        double = parted(C, P, reach, k, 0, C.first[0])
        double = double or parted(C, P, reach, k, C.first[j], C.first[j + 1])
        C.way[k] = 0.0 if double else 1.0
    kept = C.first[0]
    for b in range(C.first.size - 1):
        start, end = C.first[b], C.first[b + 1]
        C.first[b] = kept
        for k in range(start, end):
            if C.way[k] > 0.0:
                for p in range(5):
                    C.who[kept, p] = C.who[k, p]
                for p in range(4):
                    C.along[kept, p] = C.along[k, p]
                C.gap[kept], C.bond[kept] = C.gap[k], C.bond[k]
                kept += 1
    C.first[C.first.size - 1] = C.used[0] = kept


@inner
def contact_rows(B, P, T, C):
    """Slip of all contacts, and the gradients of gap and slip; `detect` first."""
    for k in range(C.used[0]):
        i, a, j, c, o = C.who[k]
        w, nx, ny = C.along[k, 0], C.along[k, 1], C.along[k, 2]
        C.along[k, 3] = math.hypot(P[o, 0] - P[c, 0], P[o, 1] - P[c, 1])
        C.slip[k] = (w - C.anchor[k]) * C.along[k, 3]
        for p in range(B.size[i]):
            C.n[k, 0, p] = T[a, 0, p] * nx + T[a, 1, p] * ny
            C.t[k, 0, p] = T[a, 1, p] * nx - T[a, 0, p] * ny
        for p in range(B.size[j]):
            x = (1 - w) * T[c, 0, p] + w * T[o, 0, p]
            y = (1 - w) * T[c, 1, p] + w * T[o, 1, p]
            C.n[k, 1, p] = -x * nx - y * ny
            C.t[k, 1, p] = x * ny - y * nx


@kernel
def find_contacts(B, law, q, old, C, P, T):
    """Corners, contacts and their gradients at the coordinates q."""
    place_corners(B, q, P, T)
    detect(B, law, P, old, C)
    contact_rows(B, P, T, C)
