"""Spinning round solids, reduced, in axes that do not spin.

A round body bends alike in all planes, so that its modes come in pairs. One of each pair moves in
the plane X-Z, and the other is the same shape turned by 90 degrees. In axes that do not spin,
material passes through the shape: with D the derivative of displacements around the axis, spinning
at W about Z adds the forces 2 W int(rho phi^T D phi), in which only displacements along the axis
take part when the shape is that of bending.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from rom.arguments import check_places
from rom.body.flexible import FlexibleBody
from rom.components.round_bodies.spins import directed_mass
from rom.components.transmission.housing import motion_of
from rom.components.transmission.shaft import Disc
from rom.errors import ModelError
from rom.model import Array

MAX_MODES = 8  # of each kind, next to the static shapes under loads on the seats
PAIR_RTOL = 0.02  # difference of the frequencies of a pair
PLANARITY_RTOL = 0.05  # motion out of a plane
DEPENDENT_RTOL = 1e-10


@dataclass(frozen=True)
class SolidShaft:
    """A reduced body of revolution about the Z axis of its frame, which takes a shaft's place.

    Its seats count as nodes. Coordinates, all of the mass of the body: bending in the plane X-Z,
    the same in Y-Z, stretching, twisting. Of each the rigid motions come first; static shapes under
    loads on the seats and the lowest modes follow.

    Attributes:
        body: with its journals and the seat of the wheel as interfaces; mean motions count.
        seats: names of the interfaces, in the order of the nodes.
        discs: on the seats.

    Raises:
        ModelError: if a disc sits beyond the seats.
    """

    body: FlexibleBody
    seats: Sequence[str]
    discs: Sequence[Disc] = ()

    def __post_init__(self) -> None:
        nodes = [disc.node for disc in self.discs]
        check_places("discs at seats", nodes, len(self.seats), error=ModelError)
        for name in self.seats:
            x, y, _ = self.body.marker(name).point
            if np.hypot(x, y) > 1e-3 * self.body.size:
                text = f"the seat {name!r} of {self.body.name!r} is at x = {x:.4g} m, y = {y:.4g} m"
                raise ModelError(f"{text}; the axis of the shaft has to be the Z axis of the body.")

    @property
    def nodes(self) -> int:
        """Number of seats."""
        return len(self.seats)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        bend, stretch, twist = self._shapes
        return 2 * bend.shape[1] + stretch.shape[1] + twist.shape[1]

    def rows(self, node: int) -> Array:
        """(6, n) mean motion of a seat [m, rad] per coordinate."""
        (X, Z, T), B = self._shapes, motion_of(self.body, self.seats[node])
        b = X.shape[1]
        found = np.zeros((6, self.n))
        found[0, :b] = found[1, b : 2 * b] = B[0] @ X
        found[4, :b] = B[4] @ X
        found[3, b : 2 * b] = -B[4] @ X
        found[2, 2 * b : 2 * b + Z.shape[1]] = B[2] @ Z
        found[5, 2 * b + Z.shape[1] :] = B[5] @ T
        return found

    def rigid(self) -> Array:
        """(n, 6) rigid motions along the axes, about them at z = 0, in units of the coordinates."""
        X, Z, T = self._shapes
        b, z = X.shape[1], 2 * X.shape[1]
        found = np.zeros((self.n, 6))
        moves = np.linalg.solve(X[[0, 4], :2], np.eye(2))  # along X, about Y
        found[:2, [0, 4]], found[b : b + 2, [1, 3]] = moves, moves * [1, -1]
        found[z, 2], found[z + Z.shape[1], 5] = 1 / Z[2, 0], 1 / T[5, 0]
        return found

    def matrices(self) -> tuple[Array, Array, Array]:
        """(n, n) mass, stiffness, and gyroscopic matrix per speed, in units of the coordinates."""
        (X, Z, T), (M, K) = self._shapes, self.body.full_matrices()
        b, n = X.shape[1], self.n
        whole_M, whole_K, G = np.zeros((3, n, n))
        parts = np.split(np.arange(n), [b, 2 * b, 2 * b + Z.shape[1]])
        for at, V in zip(parts, (X, X, Z, T), strict=True):
            whole_M[np.ix_(at, at)], whole_K[np.ix_(at, at)] = V.T @ M @ V, V.T @ K @ V
        spin = 2 * X.T @ directed_mass(self.body, np.diag([0.0, 0.0, 1.0])) @ X
        G[:b, b : 2 * b], G[b : 2 * b, :b] = spin, -spin
        for disc in self.discs:
            disc.add_to(whole_M, G, self.rows(disc.node))
        return whole_M, whole_K, G

    @cached_property
    def _shapes(self) -> tuple[Array, Array, Array]:
        """(6 + r, .) shapes of bending in X-Z, stretching, twisting; rigid motions first."""
        M, K = self.body.full_matrices()
        omega2, V = eigh(K, M)
        omega, V, rigid = np.sqrt(omega2[6:]), V[:, 6:], np.eye(len(V))[:, :6]
        R = np.stack([motion_of(self.body, name) for name in self.seats])
        # what seats feel of each mode, angles at the radius of gyration
        turn = np.sqrt(self.body.inertia[2, 2] / self.body.mass)
        B = R @ V * np.r_[1, 1, 1, [turn] * 3][:, None]
        felt = [np.abs(B[:, k]).max(axis=(0, 1)) for k in ([0, 1, 3, 4], [2], [5])]
        bent, stretched, twisted = (np.flatnonzero(np.argmax(felt, axis=0) == k) for k in range(3))
        pairs = self._in_plane(omega[bent], V[:, bent], B[:, :, bent])
        modes = (pairs, V[:, stretched[:MAX_MODES]], V[:, twisted[:MAX_MODES]])
        flexibility = (V / omega**2) @ V.T
        found = []
        for own, shapes in zip(([0, 4], [2], [5]), modes, strict=True):
            both = np.hstack([flexibility @ R[:, own].reshape(-1, len(V)).T, shapes])
            found.append(_normalised(M, rigid[:, own], both, self.body.mass))
        return found[0], found[1], found[2]

    def _in_plane(self, omega: Array, V: Array, B: Array) -> Array:
        """(6 + r, m) of each pair of bending modes the one that moves in X-Z."""
        found = []
        for k in range(0, min(2 * MAX_MODES, omega.size - 1), 2):
            _, s, turn = np.linalg.svd(B[:, [1, 3], k : k + 2].reshape(-1, 2))
            if omega[k + 1] > (1 + PAIR_RTOL) * omega[k] or s[1] > PLANARITY_RTOL * s[0]:
                break
            found.append(V[:, k : k + 2] @ turn[1])
        if not found:
            f = omega[:2] / (2 * np.pi)
            text = f"the body {self.body.name!r} is not round about its Z axis: its first bending"
            hint = "Refine the mesh around the axis, or use beams."
            raise ModelError(f"{text} modes are no pair, at {f.round(1).tolist()} Hz.", hint=hint)
        return np.stack(found, axis=1)


def _normalised(M: Array, rigid: Array, elastic: Array, mass: float) -> Array:
    """(6 + r, m) orthogonal shapes that span the same, each of that mass; rigid ones first."""
    found = rigid * np.sqrt(mass / np.sum(rigid * (M @ rigid), axis=0))
    elastic = elastic / np.sqrt(np.sum(elastic * (M @ elastic), axis=0))
    size, V = np.linalg.eigh(elastic.T @ M @ elastic)
    keep = size > DEPENDENT_RTOL
    return np.hstack([found, elastic @ V[:, keep] * np.sqrt(mass / size[keep])])
