"""Solids at large deflection: what their strain energy has beyond q K q / 2, as elements.

The body itself has the force K q, and inertia, markers and loads of other bodies: shapes are linear
in q. Stiffening by rotation is in the energy: such a body has no geometric stiffness beside. Of a
linear material, see `rom.body.nonlinear.quartic`,

    U - q K q / 2 = q (S3 + S4) q,    S3 = T3 q,  S4 = T4 q q
    force = 3 S3 q + 4 S4 q,    tangent = 6 S3 + 12 S4,

and of neo-Hookean material, over the points that were kept, see `rom.body.nonlinear.sampled`,

    force = sum of w G^T P - K q,    tangent = sum of w G^T dP/dF G - K

where, with Y_k = F^-1 G_k::

    G_k : dP/dF : G_l = mu G_k : G_l + (mu - lam ln J) tr(Y_k Y_l) + lam tr(Y_k) tr(Y_l)
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import log1p, nan
from typing import Any

import numpy as np

from rom.errors import ModelError
from rom.mbs.elements.family import Family, Places, apart, integers, never, on_joint, starts
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.markers import own_corner
from rom.mbs.kernels.tables import Array1, Array2, Array3, Index1, Scratch1, Scratch2, Table, table
from rom.mbs.parts.bodies import Part
from rom.notebook import listed


@dataclass(frozen=True, slots=True)
class LargeDeflection:
    """The energy of a body of large deflection, a `rom.body.nonlinear.quartic.Quartic`."""

    body: str
    energy: Any


@table
class Quartics(Table):
    """All bodies of large deflection; p <= P counts pairs of coordinates i <= j, last fastest."""

    body: Index1  # (e,) which
    energy: Index1  # (e,) which of the u energies it has
    by_one: Array3  # (u, R, P) T3, its last two indices as a pair [N/m^2]
    by_two: Array3  # (u, P, P) T4 by its first and last two indices [N/m^3]
    square: Scratch1  # (P,) products of coordinates, twice where these differ
    S3: Scratch2  # (e, P) contraction at the last residual
    S4: Scratch2  # (e, P) likewise


def pack_quartics(found: Mapping[str, LargeDeflection], places: Places) -> Quartics:
    """The energies as arrays, those of equal bodies once."""
    energies = {id(one.energy): one.energy for one in found.values()}
    R, u, e = max((x.n for x in energies.values()), default=0), len(energies), len(found)
    P = R * (R + 1) // 2
    by_one, by_two = np.zeros((u, R, P)), np.zeros((u, P, P))
    for k, x in enumerate(energies.values()):
        T3, T4 = x.by_pairs
        by_one[k, : x.n, : len(T3)] = T3.T
        by_two[k, : len(T4), : len(T4)] = T4
    body = integers(places.body[one.body] for one in found.values())
    which = integers(list(energies).index(id(one.energy)) for one in found.values())
    return Quartics(body, which, by_one, by_two, np.zeros(P), np.zeros((e, P)), np.zeros((e, P)))


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


ONE_BODY = {"ends": on_joint, "couples": apart, "by_rate": never}
KERNELS = pack_quartics, quartic_residuals, quartic_tangents, quartic_energy
QUARTICS_FAMILY = Family("bodies of large deflection", LargeDeflection, *KERNELS, **ONE_BODY)


@table
class Samples(Table):
    """All bodies of sampled elements."""

    body: Index1  # (e,) which
    start: Index1  # (e + 1,) first of its points
    gradients: Array3  # (p, 9, R) displacement gradient per unit of each coordinate [1/m]
    weights: Array1  # (p,) [m^3]
    lame: Array2  # (p, 2) lam and mu [Pa]
    K: Array3  # (e, R, R) stiffness at small deflection [N/m]
    state: Scratch2  # (p, 20) gradient H, inverse of F, ln J, energy density, at the last residual
    Y: Scratch2  # (9, R) F^-1 G at a point
    stress: Scratch1  # (9,) P at a point


def pack_samples(found: Mapping[str, LargeDeflection], places: Places) -> Samples:
    """The energies as arrays."""
    every = [one.energy for one in found.values()]
    counts = [len(x.weights) for x in every]
    R, p, e = max((x.n for x in every), default=0), sum(counts), len(every)
    G, K, start = np.zeros((p, 9, R)), np.zeros((e, R, R)), starts(counts)
    for k, x in enumerate(every):
        G[start[k] : start[k + 1], :, : x.n] = x.gradients
        K[k, : x.n, : x.n] = x.K
    body = integers(places.body[one.body] for one in found.values())
    weights, lame = (np.concatenate([getattr(x, y) for x in every]) for y in ("weights", "lame"))
    memory = np.zeros((p, 20)), np.zeros((9, R)), np.zeros(9)
    return Samples(body, start, G, weights, lame, K, *memory)


@inner
def take_state(s, samples, e, p, q):
    """Set the state of point p of element e at the coordinates of its body."""
    b, X = samples.body[e], samples.state[p]
    at, r = s.bodies.q_at[b] + 7, s.bodies.r[b]
    for i in range(9):
        X[i] = 0.0
        for k in range(r):
            X[i] += samples.gradients[p, i, k] * q[at + k]
    minors = X[0] * X[4] - X[1] * X[3] + X[0] * X[8] - X[2] * X[6] + X[4] * X[8] - X[5] * X[7]
    third = X[0] * (X[4] * X[8] - X[5] * X[7]) - X[1] * (X[3] * X[8] - X[5] * X[6])
    third += X[2] * (X[3] * X[7] - X[4] * X[6])
    grown = X[0] + X[4] + X[8] + minors + third
    X[18] = log1p(grown) if grown > -1.0 else nan
    a, d, g = 1.0 + X[0], 1.0 + X[4], 1.0 + X[8]
    J = 1.0 + grown
    X[9], X[10], X[11] = d * g - X[5] * X[7], X[2] * X[7] - X[1] * g, X[1] * X[5] - X[2] * d
    X[12], X[13], X[14] = X[5] * X[6] - X[3] * g, a * g - X[2] * X[6], X[2] * X[3] - a * X[5]
    X[15], X[16], X[17] = X[3] * X[7] - d * X[6], X[1] * X[6] - a * X[7], a * d - X[1] * X[3]
    square = 2.0 * (X[0] + X[4] + X[8])
    for i in range(9):
        X[9 + i] /= J
        square += X[i] * X[i]
    lam, mu = samples.lame[p, 0], samples.lame[p, 1]
    X[19] = mu * (0.5 * square - X[18]) + 0.5 * lam * X[18] * X[18]


@residuals.of(Samples)
def sample_residuals(s, W, samples, q, v, _lam):
    """Add the forces beyond those of small deflection to W.residual."""
    P = samples.stress
    for e in range(samples.body.size):
        b = samples.body[e]
        at, t, r = s.bodies.q_at[b] + 7, s.bodies.v_at[b] + 6, s.bodies.r[b]
        for i in range(r):
            for j in range(r):
                W.residual[t + i] -= samples.K[e, i, j] * q[at + j]
        for p in range(samples.start[e], samples.start[e + 1]):
            take_state(s, samples, e, p, q)
            X, w = samples.state[p], samples.weights[p]
            lam, mu = samples.lame[p, 0], samples.lame[p, 1]
            for i in range(3):
                for j in range(3):
                    F = X[3 * i + j] + (1.0 if i == j else 0.0)
                    turned = X[9 + 3 * j + i]
                    P[3 * i + j] = w * (mu * (F - turned) + lam * X[18] * turned)
            for k in range(r):
                for i in range(9):
                    W.residual[t + k] += samples.gradients[p, i, k] * P[i]


@inner
def pull_back(samples, p, r):
    """Set Y to F^-1 G at a point of a body of r coordinates; its state first."""
    X, G, Y = samples.state[p], samples.gradients[p], samples.Y
    for i in range(3):
        for j in range(3):
            for k in range(r):
                Y[3 * i + j, k] = 0.0
                for l in range(3):
                    Y[3 * i + j, k] += X[9 + 3 * i + l] * G[3 * l + j, k]


@tangents.of(Samples)
def sample_tangents(s, W, samples, _lam, ck, _cc):
    """Add ck times the derivative of the forces to W.Kt; `sample_residuals` first."""
    Y = samples.Y
    for e in range(samples.body.size):
        b = samples.body[e]
        (x, y), r = own_corner(s, b), s.bodies.r[b]
        for k in range(r):
            for l in range(r):
                W.Kt[x + 6 + k, y + 6 + l] -= ck * samples.K[e, k, l]
        for p in range(samples.start[e], samples.start[e + 1]):
            G, w = samples.gradients[p], ck * samples.weights[p]
            lam, mu = samples.lame[p, 0], samples.lame[p, 1]
            second = mu - lam * samples.state[p, 18]
            pull_back(samples, p, r)
            for k in range(r):
                trace = lam * (Y[0, k] + Y[4, k] + Y[8, k])
                for l in range(r):
                    total = trace * (Y[0, l] + Y[4, l] + Y[8, l])
                    for i in range(9):
                        total += mu * G[i, k] * G[i, l]
                        total += second * Y[i, k] * Y[3 * (i % 3) + i // 3, l]
                    W.Kt[x + 6 + k, y + 6 + l] += w * total


@energy.of(Samples)
def sample_energy(s, _W, samples, q, _v):
    """Energy beyond that of small deflection."""
    total = 0.0
    for e in range(samples.body.size):
        b = samples.body[e]
        at, r = s.bodies.q_at[b] + 7, s.bodies.r[b]
        for p in range(samples.start[e], samples.start[e + 1]):
            take_state(s, samples, e, p, q)
            total += samples.weights[p] * samples.state[p, 19]
        for i in range(r):
            for j in range(r):
                total -= 0.5 * q[at + i] * samples.K[e, i, j] * q[at + j]
    return total


OF_SAMPLES = pack_samples, sample_residuals, sample_tangents, sample_energy
SAMPLES_FAMILY = Family("bodies of sampled elements", LargeDeflection, *OF_SAMPLES, **ONE_BODY)


def deflection_of(part: Part) -> tuple[LargeDeflection, Family]:
    """The energy of a body of large deflection beyond that of small deflection, and its family."""
    body = part.flexible
    if body.K_geo:
        text = f"body {body.name!r} has the energy of large deflection, in which all loads stiffen"
        twice = f"the geometric stiffness {listed(body.K_geo)} would be counted twice"
        raise ModelError(f"{text}; {twice}.")
    if part.spin.any():
        text = "a body of large deflection does not spin in a frame that rests; turn it by omega."
        raise ModelError(text, where=part.name)
    family = SAMPLES_FAMILY if hasattr(body.quartic, "gradients") else QUARTICS_FAMILY
    return LargeDeflection(part.name, body.quartic), family
