"""Identical blades around an axis: small motions of all of them, in axes that do not turn.

Blade k of N stands at the azimuth psi_k = psi + 2 pi k / N. Its motion p_k, in axes that turn with
it, is a sum of what all blades do alike and of cosines and sines over the azimuth,

    p_k = z_0 / sqrt(N) + sqrt(2 / N) sum_h (z_hc cos h psi_k + z_hs sin h psi_k),

for an even number and one motion more, + and - in turn. A rotor of three or more blades on a
support that does not turn has periodic coefficients in p_k, and constant ones in z.

Source:
    Coleman and Feingold, NACA Report 1351, 1958; Johnson, Helicopter Theory, 1980, chapter 8.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, identity

from rom import rotation
from rom.errors import ConfigError
from rom.mbs.equations.packing import Packed
from rom.mbs.results.state import State
from rom.model import Array, Index
from rom.names import check_known, check_once

MIN_BLADES = 3  # with two, coefficients stay periodic
SPACING_TOL = 1e-3  # of the azimuth of a blade [rad]
MASS_RTOL = 1e-9  # by which identical blades may differ


@dataclass(frozen=True)
class Blades:
    """Blades of one rotor."""

    bodies: Index  # (N, b) numbers of the bodies
    coordinates: Index  # (N, m) numbers in `State.v` of the same coordinates of each blade
    q_at: int  # where the quaternion of the first body of the first blade stands
    v_at: int  # where its angular velocity stands
    home: Array  # (3, 3) axes of this body where the azimuth counts as zero
    axis: Array  # (3,) of the rotor, about which the blades follow each other [1]

    @classmethod
    def of(cls, blades: object, packed: Packed, state: State) -> "Blades":
        """Blades that the caller names, one after the other around the axis."""
        rows = _bodies(blades, packed)
        bodies = packed.system.bodies
        own = [at + np.arange(6 + r) for at, r in zip(bodies.v_at, bodies.r, strict=True)]
        coordinates = np.array([np.concatenate([own[b] for b in row]) for row in rows])
        q_at, v_at = (int(at[rows[0, 0]]) + 3 for at in (bodies.q_at, bodies.v_at))
        quaternions = (bodies.q_at[b] + 3 + np.arange(4) for b in rows[:, 0])
        axes = [rotation.matrix(state.q[at]) for at in quaternions]
        turn = rotation.log(rotation.quaternion(axes[1] @ axes[0].T))
        axis = turn / max(float(np.linalg.norm(turn)), 1e-300)
        for k, A in enumerate(axes):
            there = rotation.matrix(rotation.exp(2 * np.pi * k / len(rows) * axis)) @ axes[0]
            if np.abs(A - there).max() > SPACING_TOL:
                angle, first = 360 * k / len(rows), packed.names[rows[0, 0]]
                text = f"blades: {packed.names[rows[k, 0]]!r} does not stand {angle:g} degrees from"
                hint = "Name them in turn around the axis, turned alike; gravity bends them apart."
                raise ConfigError(f"{text} {first!r} about one axis.", hint=hint)
        return cls(rows, coordinates, q_at, v_at, axes[0], axis)

    def speed(self, state: State) -> float:
        """Angular velocity about the axis [rad/s]."""
        A = rotation.matrix(state.q[self.q_at : self.q_at + 4])
        return float(self.axis @ A @ state.v[self.v_at : self.v_at + 3])

    def azimuth(self, state: State) -> float:
        """Angle since the azimuth was zero [rad]."""
        A = rotation.matrix(state.q[self.q_at : self.q_at + 4])
        return float(rotation.log(rotation.quaternion(A @ self.home.T)) @ self.axis)

    def motions(self, state: State) -> tuple[csc_matrix, csc_matrix, csc_matrix]:
        """(n, n) p per z; the same of their rates and accelerations per z; all sparse."""
        N = len(self.coordinates)
        psi = self.azimuth(state) + 2 * np.pi / N * np.arange(N)
        B, S = np.full((N, N), 1 / np.sqrt(N)), np.zeros((N, N))
        for h in range(1, (N + 1) // 2):
            c, s = 2 * h - 1, 2 * h
            B[:, c], B[:, s] = np.sqrt(2 / N) * np.cos(h * psi), np.sqrt(2 / N) * np.sin(h * psi)
            S[s, c], S[c, s] = -h, h  # derivatives of both by the azimuth
        if N % 2 == 0:
            B[:, -1] = (-1.0) ** np.arange(N) / np.sqrt(N)
        S *= self.speed(state)
        return self._all(B, others=1.0, n=state.v.size), *(
            self._all(A, others=0.0, n=state.v.size) for A in (B @ S, B @ S @ S)
        )

    def _all(self, block: Array, *, others: float, n: int) -> csc_matrix:
        """(n, n) the block (N, N) for each coordinate of the blades, a number for all others."""
        N, m = self.coordinates.shape
        rows = np.repeat(self.coordinates, N, axis=0).ravel()
        columns = np.tile(self.coordinates, (N, 1)).ravel()
        diagonal = np.full(n, others)
        diagonal[self.coordinates.ravel()] = 0.0
        wave = csc_matrix((np.repeat(block.ravel(), m), (rows, columns)), (n, n))
        return wave + csc_matrix(identity(n).multiply(diagonal))

    def waves(self, shapes: Array, state: State) -> Array:
        """(f, 3) shares of the motion of the blades [1]: all alike, backward and forward waves.

        The shapes (n, f) are modes in all coordinates, of comparable units, around the state. Waves
        run around the support, forward in the sense in which the rotor turns. The motion +
        and - in turn of an even number runs nowhere: its share is missing in the sum.
        """
        N = len(self.coordinates)
        square = (np.abs(np.fft.fft(shapes[self.coordinates], axis=0)) ** 2).sum(axis=1)
        # row h is the wave exp(i (w t + h psi)), which runs towards falling azimuths
        falling, growing = square[1 : (N + 1) // 2].sum(axis=0), square[N // 2 + 1 :].sum(axis=0)
        two = (falling, growing) if self.speed(state) >= 0.0 else (growing, falling)
        total = np.maximum(square.sum(axis=0), 1e-300)
        return (np.stack([square[0], *two]) / total).T


def _bodies(blades: object, packed: Packed) -> Index:
    """(N, bodies of a blade) numbers of bodies, refused if they are no identical blades."""
    if isinstance(blades, str) or not isinstance(blades, Sequence) or len(blades) < MIN_BLADES:
        raise ConfigError(f"blades must be {MIN_BLADES} or more, each named by its bodies.")
    number_of: dict[object, int] = {name: b for b, name in enumerate(packed.names)}
    named = [[getattr(x, "name", x) for x in _parts(blade)] for blade in blades]
    for name in (name for row in named for name in row):
        check_known(name, packed.names, f"blades: no body {name!r}; there are")
    rows = [[number_of[name] for name in row] for row in named]
    masses, shapes = packed.system.bodies.mass, packed.system.bodies.r
    alike = all(
        len(row) == len(rows[0]) > 0
        and np.array_equal(shapes[row], shapes[rows[0]])
        and np.allclose(masses[row], masses[rows[0]], rtol=MASS_RTOL)
        for row in rows
    )
    if not alike:
        raise ConfigError("blades must be alike: the same bodies in the same order for each.")
    every = np.array(rows)
    check_once((packed.names[k] for k in every.flat), "blades: body")
    return every


def _parts(blade: object) -> Sequence[object]:
    """The bodies of a blade: of a non-linear body, of a list, or the one body it is."""
    parts = getattr(blade, "parts", blade)
    return parts if isinstance(parts, list | tuple) else [parts]
