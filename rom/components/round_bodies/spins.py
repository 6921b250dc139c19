"""Round bodies that turn in a frame which does not, as elements: their gyroscopic forces.

The frame follows the bending of a shaft, say, but does not turn with it. A displacement u of a body
of revolution is a field in that frame, through which the material passes with the velocity
W z x X. Its own velocity is W z x X + du/dt + W A u,

    A u = (z x X) . grad u = z x u - L u,

where L is how the field changes as it is turned as a whole. L takes modes of one frequency into
each other: of a pair with n waves around the axis, n times one into the other. The kinetic energy
gives the forces -2 W int(rho phi^T A phi) du/dt. Terms of W^2, which cancel for a rigid body, would
need displacements of second order; they are small as long as W is small against the frequencies.

Source:
    Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines (2010), chapter 5, of shafts;
    Genta, Dynamics of Rotating Systems (2005), chapter 6, of solids in fixed axes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigh
from scipy.spatial import cKDTree

from rom.errors import ModelError
from rom.mbs.elements.family import (
    Family,
    Hooks,
    Places,
    apart,
    from_outside,
    integers,
    never,
    on_joint,
)
from rom.mbs.kernels.element_calls import residuals, tangents
from rom.mbs.kernels.markers import own_corner
from rom.mbs.kernels.system import System
from rom.mbs.kernels.tables import Array3, Index1, Table, table
from rom.mbs.kernels.work import Work
from rom.mbs.parts.bodies import MESHED_RTOL, Part
from rom.model import Array, Index
from rom.rotation import exp, matrix, skew

if TYPE_CHECKING:
    from rom.body.flexible import FlexibleBody

TEST_TURN = 0.1  # by which fields are turned to see which modes go into which [rad]
SAME_FREQUENCY_RTOL = 0.02  # of modes that a mesh, round but for its facets, leaves apart
ROUND_RTOL = 0.02  # of moments of inertia across the axis
N_NEAREST = 12  # triangles whose middle is near a point: one of them holds it


def spin_matrices(body: "FlexibleBody", axis: Array) -> tuple[Array, Array]:
    """Forces per speed of a body whose material turns through its frame.

    Found are those on rotations and shapes per velocity of them, (3 + r, 3 + r) and antisymmetric,
    and those of damping on shapes per elastic coordinate, (r, r). The body is round about an axis
    (3,) through its mass centre, in its frame. The material feels its damping as it passes through
    a bent shape that stands: this feeds whirl that is slower than the rotation.
    """
    check_round(body.name, body.mass, body.first_moment, body.inertia, axis)
    M, K = body.full_matrices()
    lam, V = eigh(K, M)
    turning = V @ _generator(body, axis, lam, V) @ V.T @ M  # of coordinates
    whole = 2.0 * (M @ turning - directed_mass(body, skew(axis)))
    return 0.5 * (whole - whole.T)[3:, 3:], body.D @ turning[6:, 6:]


def check_round(name: str, mass: float, first: Array, inertia: Array, axis: Array) -> None:
    """Refuse a body whose material cannot turn through its frame."""
    polar = axis @ inertia @ axis
    tilted = np.abs(inertia @ axis - polar * axis).max()
    flat = np.eye(3) - np.outer(axis, axis)
    across = np.linalg.eigvalsh(flat @ inertia @ flat)[1:]
    apart = float(np.linalg.norm(np.cross(axis, first)) / mass)
    size = np.sqrt(np.trace(inertia) / mass)
    if max(across[1] - across[0], tilted) > ROUND_RTOL * across[1] or apart > MESHED_RTOL * size:
        J = f"its inertia across {axis.round(6).tolist()} is {across.round(9).tolist()} kg m^2"
        text = "only a round body can turn through a frame; give omega instead of spin"
        raise ModelError(f"{text}: {J}, its mass centre lies {apart:.3g} m beside.", where=name)


def _generator(body: "FlexibleBody", axis: Array, lam: Array, V: Array) -> Array:
    """(6 + r, 6 + r) change of modes as fields are turned, in multiples of modes."""
    found = np.zeros((lam.size, lam.size))
    found[:6, :6] = _rigid_generator(body, axis, V)
    turned = _turned_modes(body, axis, V[:, 6:])
    for group in _groups(lam[6:]):
        u, _, w = np.linalg.svd(turned[np.ix_(group, group)])
        values, vectors = np.linalg.eig(u @ w)  # of the rotation that is nearest to it
        n = np.round(np.angle(values) / TEST_TURN)
        whole = (vectors * (1j * n)) @ np.linalg.inv(vectors)
        found[np.ix_(group + 6, group + 6)] = 0.5 * (whole - whole.T).real
    return found


def _groups(lam: Array) -> list[Index]:
    """Numbers of the modes that share a frequency."""
    omega = np.sqrt(np.maximum(lam, 0.0))
    ends = np.flatnonzero(np.diff(omega) > SAME_FREQUENCY_RTOL * omega[1:]) + 1
    return np.split(np.arange(lam.size), ends)


def _rigid_generator(body: "FlexibleBody", axis: Array, V: Array) -> Array:
    """(6, 6) the same of the rigid modes, whose translations and rotations turn as vectors."""
    centre = body.first_moment / body.mass
    rigid = V[:6, :6].copy()  # translation and rotation about the origin
    rigid[:3] += np.cross(rigid[3:].T, centre).T  # of the mass centre
    return np.linalg.solve(rigid, np.kron(np.eye(2), skew(axis)) @ rigid)


def _turned_modes(body: "FlexibleBody", axis: Array, V: Array) -> Array:
    """(m, m) the elastic modes of V (6 + r, m) turned by the test angle, in multiples of them."""
    surface = body.surface
    if surface is None:
        text = "a round body that turns through its frame needs a surface; reduce it from a mesh."
        raise ModelError(text, where=body.name)
    X, centre = surface.points, body.first_moment / body.mass
    fields = _fields(X, surface.shape, V)
    R = matrix(exp(TEST_TURN * axis))
    back = (X - centre) @ R + centre
    nodes, share = _places(X, surface.triangles, back)
    turned = np.einsum("ab,sk,skbm->sam", R, share, fields[nodes])
    weight = np.sqrt(body.surface_areas())[:, None, None]
    flat = (weight * fields).reshape(-1, V.shape[1]), (weight * turned).reshape(-1, V.shape[1])
    return np.linalg.lstsq(*flat, rcond=1e-9)[0]


def _fields(X: Array, shape: Array, V: Array) -> Array:
    """(s, 3, m) displacements of surface points in motions V (6 + r, m)."""
    rigid = V[None, :3] + np.cross(V[3:6].T[None], X[:, None]).transpose(0, 2, 1)
    return rigid + (shape @ V[6:]).reshape(len(X), 3, -1)


def _places(X: Array, triangles: Index, points: Array) -> tuple[Index, Array]:
    """(s, 3) corners of the triangles that hold points (s, 3), and (s, 3) their shares."""
    corners = X[triangles]
    near = cKDTree(corners.mean(axis=1)).query(points, min(N_NEAREST, len(triangles)))[1]
    a, e, f = np.moveaxis(corners[near], 2, 0)
    d, e, f = points[:, None] - a, e - a, f - a
    ee, ef, ff = (np.einsum("skx,skx->sk", *x) for x in ((e, e), (e, f), (f, f)))
    de, df = (np.einsum("skx,skx->sk", d, x) for x in (e, f))
    det = np.maximum(ee * ff - ef**2, 1e-300)
    v, w = (ff * de - ef * df) / det, (ee * df - ef * de) / det
    share = np.stack([1 - v - w, v, w], axis=2)
    off = d - v[..., None] * e - w[..., None] * f
    size = np.sqrt(ee + ff)
    outside = np.linalg.norm(off, axis=2) / size + np.maximum(-share, 0.0).sum(axis=2)
    best = np.argmin(outside, axis=1)
    rows = np.arange(len(points))
    kept = np.clip(share[rows, best], 0.0, 1.0)
    return triangles[near[rows, best]], kept / kept.sum(axis=1, keepdims=True)


def directed_mass(body: "FlexibleBody", E: Array) -> Array:
    """(6 + r, 6 + r) integrals of rho phi_a . E phi_b, rigid motions first.

    E (3, 3) in the body frame is z x of a spin, or z z^T for the mass of motions along z [1].
    """
    r, second = body.n_modes, 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
    turns = np.array([skew(np.eye(3)[p]) for p in range(3)])  # rotation p moves X by turns[p] X
    found = np.zeros((6 + r, 6 + r))
    found[:3, :3] = body.mass * E
    arms = np.einsum("pab,b->ap", turns, body.first_moment)  # integral of rho of rotations
    found[:3, 3:6], found[3:6, :3] = E @ arms, arms.T @ E
    found[3:6, 3:6] = np.einsum("pab,ac,qcd,bd->pq", turns, E, turns, second)
    found[:3, 6:], found[6:, :3] = E @ body.S, body.S.T @ E
    found[3:6, 6:] = np.einsum("pab,ac,bck->pk", turns, E, body.Ibar_kl)
    found[6:, 3:6] = np.einsum("pab,ca,bck->kp", turns, E, body.Ibar_kl)
    found[6:, 6:] = np.einsum("abkl,ab->kl", body.S_kl, E)
    return found


@dataclass(frozen=True, slots=True)
class Spin:
    """A body that turns; arrays as in `Spins`."""

    body: str
    gyroscopic: Array
    circulatory: Array


def spin_of(part: Part) -> tuple[Spin, Family]:
    """The gyroscopic forces of a body, and their family."""
    speed = float(np.linalg.norm(part.spin))
    axis = part.spin / speed
    if part.flexible is None:
        inertia = np.trace(part.second) * np.eye(3) - part.second
        check_round(part.name, part.mass, part.first, inertia, axis)
        gyroscopic, circulatory = skew(inertia @ axis), np.zeros((0, 0))
    else:
        gyroscopic, circulatory = spin_matrices(part.moving, axis)
    return Spin(part.name, speed * gyroscopic, speed * circulatory), SPINS_FAMILY


@table
class Spins(Table):
    """All bodies that turn."""

    body: Index1  # (k,) which
    gyroscopic: Array3  # (k, 3 + R, 3 + R) forces on rotations and shapes per velocity of them
    circulatory: Array3  # (k, R, R) of damping on shapes per elastic coordinate


def pack(spins: Mapping[str, Spin], places: Places) -> Spins:
    """The spins as arrays."""
    n, R = len(spins), places.R
    G, C = np.zeros((n, 3 + R, 3 + R)), np.zeros((n, R, R))
    for k, one in enumerate(spins.values()):
        r = len(one.circulatory)
        G[k, : 3 + r, : 3 + r], C[k, :r, :r] = one.gyroscopic, one.circulatory
    return Spins(integers(places.body[one.body] for one in spins.values()), G, C)


@residuals.of(Spins)
def spin_forces(s: System, W: Work, spins: Spins, q: Array, v: Array, _lam: Array) -> None:
    """Subtract the forces from W.residual; what turns the body drives those of damping."""
    for k in range(spins.body.size):
        b = spins.body[k]
        at, first, r = s.bodies.v_at[b] + 3, s.bodies.q_at[b] + 7, s.bodies.r[b]
        for i in range(3 + r):
            for j in range(3 + r):
                W.residual[at + i] -= spins.gyroscopic[k, i, j] * v[at + j]
        for i in range(r):
            force = 0.0
            for j in range(r):
                force += spins.circulatory[k, i, j] * q[first + j]
            W.residual[at + 3 + i] -= force
            W.power[1] += force * v[at + 3 + i]


@tangents.of(Spins)
def spin_tangents(s: System, W: Work, spins: Spins, _lam: Array, ck: float, cc: float) -> None:
    """Subtract ck times the derivative by coordinates from W.Kt, cc times that by velocities."""
    for k in range(spins.body.size):
        b = spins.body[k]
        (x, y), r = own_corner(s, b), s.bodies.r[b]
        for i in range(3 + r):
            for j in range(3 + r):
                W.S[x + 3 + i, y + 3 + j] -= cc * spins.gyroscopic[k, i, j]
        for i in range(r):
            for j in range(r):
                W.Kt[x + 6 + i, y + 6 + j] -= ck * spins.circulatory[k, i, j]


FORCES = spin_forces, spin_tangents
WHERE = {"ends": on_joint, "outside": from_outside, "couples": apart}
SPINS_FAMILY = Family(
    "spins", Spin, pack, *FORCES, **WHERE, by_rate=never, hooks=Hooks(potential=False)
)
