"""Flexible bodies of large deflection: what their strain energy has beyond q K q / 2, as elements.

    U - q K q / 2 = q (S3 + S4) q,    S3 = T3 q,  S4 = T4 q q

The body itself has the force K q; the element adds 3 S3 q + 4 S4 q and the tangent 6 S3 + 12 S4,
see `rom.body.nonlinear.quartic`. The shapes are linear in q, so that inertia, markers and loads are
those of other bodies. Stiffening by rotation is in T3 and T4: such a body has no geometric
stiffness beside.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.mbs.elements.family import Family, Places, apart, integers, never, on_joint
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.markers import own_corner
from rom.mbs.kernels.tables import Array3, Index1, Scratch1, Scratch2, Table, table


@dataclass(frozen=True, slots=True)
class LargeDeflection:
    """The energy of a body of large deflection, a `rom.body.nonlinear.quartic.Quartic`."""

    body: str
    energy: Any


@table
class Quartics(Table):
    """All bodies of large deflection; p <= P counts pairs of coordinates i <= j, the last fastest.

    Attributes:
        body: (e,) which.
        energy: (e,) which of the u energies it has.
        by_one: (u, R, P) T3, its last two indices as a pair [N/m^2].
        by_two: (u, P, P) T4 by its first and last two indices [N/m^3].
        square: (P,) products of coordinates, twice where these differ.
        S3, S4: (e, P) both contractions at the last residual.
    """

    body: Index1
    energy: Index1
    by_one: Array3
    by_two: Array3
    square: Scratch1
    S3: Scratch2
    S4: Scratch2


def pack(found: Mapping[str, LargeDeflection], places: Places) -> Quartics:
    """The energies as arrays, those of equal bodies once."""
    energies = {id(one.energy): one.energy for one in found.values()}
    R, u, e = max((x.n for x in energies.values()), default=0), len(energies), len(found)
    P = R * (R + 1) // 2
    by_one, by_two = np.zeros((u, R, P)), np.zeros((u, P, P))
    for k, x in enumerate(energies.values()):
        T3, T4 = x.by_pairs
        by_one[k, : x.n, : len(T3)] = T3.T
        by_two[k, : len(T4), : len(T4)] = T4
    number = list(energies)
    return Quartics(
        integers(places.body[one.body] for one in found.values()),
        integers(number.index(id(one.energy)) for one in found.values()),
        by_one, by_two, np.zeros(P), np.zeros((e, P)), np.zeros((e, P)),
    )  # fmt: skip


@inner
def contract(s, quartics, e, q):
    """Set the rows e of S3 and S4 at the coordinates of the body.

    Whole rows are added up: sums over a row would be done number by number.
    """
    b, u = quartics.body[e], quartics.energy[e]
    at, r, p = s.bodies.q_at[b] + 7, s.bodies.r[b], 0
    for i in range(r):
        for j in range(i, r):
            quartics.square[p] = (1.0 if i == j else 2.0) * q[at + i] * q[at + j]
            p += 1
    S3, S4 = quartics.S3[e], quartics.S4[e]
    S3[:p], S4[:p] = 0.0, 0.0
    for k in range(r):
        row, x = quartics.by_one[u, k], q[at + k]
        for l in range(p):
            S3[l] += x * row[l]
    for k in range(p):
        row, x = quartics.by_two[u, k], quartics.square[k]
        for l in range(p):
            S4[l] += x * row[l]


@residuals.of(Quartics)
def quartic_residuals(s, W, quartics, q, v, _lam):
    """Add the forces beyond those of small deflection to W.residual."""
    for e in range(quartics.body.size):
        contract(s, quartics, e, q)
        b, p = quartics.body[e], 0
        at, t, r = s.bodies.q_at[b] + 7, s.bodies.v_at[b] + 6, s.bodies.r[b]
        for i in range(r):
            for j in range(i, r):
                c = 3.0 * quartics.S3[e, p] + 4.0 * quartics.S4[e, p]
                W.residual[t + i] += c * q[at + j]
                if i != j:
                    W.residual[t + j] += c * q[at + i]
                p += 1


@tangents.of(Quartics)
def quartic_tangents(s, W, quartics, _lam, ck, _cc):
    """Add ck times the derivative of the forces to W.Kt; `quartic_residuals` first."""
    for e in range(quartics.body.size):
        b, p = quartics.body[e], 0
        (x, y), r = own_corner(s, b), s.bodies.r[b]
        for i in range(r):
            for j in range(i, r):
                c = ck * (6.0 * quartics.S3[e, p] + 12.0 * quartics.S4[e, p])
                W.Kt[x + 6 + i, y + 6 + j] += c
                if i != j:
                    W.Kt[x + 6 + j, y + 6 + i] += c
                p += 1


@energy.of(Quartics)
def quartic_energy(s, _W, quartics, q, _v):
    """Energy beyond that of small deflection."""
    total = 0.0
    for e in range(quartics.body.size):
        contract(s, quartics, e, q)
        r = s.bodies.r[quartics.body[e]]
        for p in range(r * (r + 1) // 2):
            total += (quartics.S3[e, p] + quartics.S4[e, p]) * quartics.square[p]
    return total


QUARTICS_FAMILY = Family(
    "bodies of large deflection", LargeDeflection, pack, quartic_residuals, quartic_tangents,
    quartic_energy, ends=on_joint, couples=apart, by_rate=never,
)  # fmt: skip
