"""A disk whose blades are substructures of their own: each with its parameters, or its shape.

The disk alone is cyclic. For each harmonic n it is condensed to the roots of the blades, which move
by r_j = sum_n exp(i n j alpha) V_n a_n / sqrt(N), and a few waves with all roots held; its matrices
are diagonal in n, whatever stands on it::

    K_n = V_n^H C_n^H K C_n V_n,    C_n = [I; -K_ii^-1 K_ir]

The blades add their own matrices to the root each of them stands on. Nothing is assumed to be
small: a blade may be cracked, or another one. At speed disk and blades bring their Coriolis and
centrifugal matrices, K(Omega) = K + Omega^2 C, in the same coordinates; the roots of all blades are
pulled outwards as those of the tuned wheel.

Source:
    Castanier, Ottarsson and Pierre, A reduced order modeling technique for mistuned bladed disks,
    J. Vibration and Acoustics 119 (1997) 439; Castanier, Tan and Pierre, Characteristic constraint
    modes for component mode synthesis, AIAA J. 39 (2001) 1182, here of the roots of a wheel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag, eigh

from rom.arguments import Between, lowest, matrix, one_each, rows_at, typed, vector
from rom.components.wheels.blades.substructured_sector import ReducedBlade, SubstructuredSector
from rom.components.wheels.reduced import rows_of_wheel
from rom.components.wheels.sector import Complex
from rom.errors import ConfigError, ModelError
from rom.model import Array, Modes, Report
from rom.plausible import check_damping_ratio

PerBlade = Any  # an array for all blades alike, or a list of arrays, one for each
RIGID_RTOL = 1e-9  # of the largest squared frequency: what is less negative is a rigid motion


@dataclass(frozen=True)
class GyroscopicModes:
    """Motions exp(i w t) of q'' + g q' + omega^2 q = p in mass-normalised modes q.

    With y = [q'; omega q] it is y' = S y + [p; 0] of a skew S = [[-g, -omega], [omega, 0]], which
    has the eigenvalues i w with orthonormal eigenvectors: nothing grows.

    Attributes:
        w: (2n,) circular frequencies [rad/s], ascending, of both signs.
        velocities: (n, 2n) q' of each [1], where |q'|^2 + |omega q|^2 = 1.
        shapes: (n, 2n) q of each [s].
    """

    w: Array
    velocities: Complex
    shapes: Complex

    def waves(self) -> tuple[Array, Complex]:
        """Ascending w (n,) > 0 [rad/s], shapes (n, n) of length 1 [1] of the motions exp(i w t)."""
        n = len(self.shapes)
        q = self.shapes[:, n:]
        return self.w[n:], q / np.linalg.norm(q, axis=0)

    def response(self, p: Complex, sweep: Array, damping: float) -> Complex:
        """(w, n) answers q [kg^1/2 m] to p exp(i omega t), each motion with its share of damping.

        Args:
            p: (n,) forces on mass-normalised modes [N kg^-1/2].
            sweep: (w,) circular frequencies omega [rad/s].
            damping: a motion decays at this share zeta [1] of its w, exp(i w sqrt(1 - zeta^2) t).
        """
        slower = np.sqrt(1.0 - damping**2)
        met = self.velocities.conj().T @ p
        gap = 1j * (sweep[:, None] - slower * self.w) + damping * np.abs(self.w)
        return (met / gap) @ self.shapes.T / slower


def gyroscopic_modes(omega: Array, g: Array) -> GyroscopicModes:
    """Motions of q'' + g q' + omega^2 q = 0.

    Frequencies omega (n,) without g are positive, g (n, n) is skew-symmetric [rad/s].

    Source:
        Meirovitch, A new method of solution of the eigenvalue problem for gyroscopic systems,
        AIAA J. 12 (1974) 1337.
    """
    n, D = omega.size, np.diag(omega)
    w, W = eigh(-1j * np.block([[-g, -D], [D, np.zeros((n, n))]]))
    return GyroscopicModes(w, W[:n], W[n:] / omega[:, None])


@typed
@dataclass(frozen=True)
class BladedWheel:
    """A disk without blades, ready for any set of them.

    Attributes:
        sector: the sector of the tuned wheel.
        K: (d, d) stiffness [N/m; 1/s^2] of the disk in c coordinates of the roots, then
            mass-normalised waves with all roots held.
        M: (d, d) its mass [kg; 1].
        roots: (N, r, c) how the roots of the blades move by these coordinates, in units of them.
        rigid: (c, k) rigid motions of a free wheel, in units of the coordinates; k = 0 if held.
        coriolis: (d, d) Coriolis matrix of the disk per rad/s [kg], or None.
        centrifugal: (d, d) change of K per (rad/s)^2 [kg]; None at rest.
    """

    sector: SubstructuredSector
    K: Array
    M: Array
    roots: Array
    rigid: Array
    coriolis: Array | None = None
    centrifugal: Array | None = None

    @cached_property
    def certificate(self) -> Report:
        """The wheel of equal blades against the full sector, solved when this is first asked."""
        nominal = [self.sector.blade] * self.sector.n_sectors
        found = rows_of_wheel("equal blades", self.modes(nominal).frequencies, self.sector.full)
        return Report("certificate of the wheel", tuple(found))

    def matrices(
        self, blades: Sequence[ReducedBlade], *, speed: float = 0.0
    ) -> tuple[Array, Array]:
        """Stiffness [N/m; 1/s^2] and mass [kg; 1], (n, n): disk, then cantilever modes of blades.

        Blades stand in the order of the N sectors; the speed stiffens and softens them [rad/s].

        Raises:
            ConfigError: if there is not one blade for each sector, one has another root, or the
                matrices of rotation are missing.
        """
        self._check(blades)
        K, M = (self._joined(name, blades) for name in ("K", "M"))
        return (K + speed**2 * self._joined("centrifugal", blades) if speed else K), M

    def coriolis_matrix(self, blades: Sequence[ReducedBlade]) -> Array:
        """(n, n) skew-symmetric Coriolis matrix per rad/s [kg], in the coordinates of `matrices`.

        Raises:
            ConfigError: see `matrices`.
        """
        self._check(blades)
        return self._joined("coriolis", blades)

    def _check(self, blades: Sequence[ReducedBlade]) -> None:
        (N, r, _), found = self.roots.shape, [blade.n_root for blade in blades]
        if found != [r] * N:
            text = f"{len(found)} blades with {sorted(set(found))} coordinates, not {N} of {r}."
            hint = "Take sector.blade, its varied(…), or rom.reduced_blade(sector, …)."
            raise ConfigError(text, hint=hint)

    def _joined(self, name: str, blades: Sequence[ReducedBlade]) -> Array:
        """The matrix of that name of the disk, and those of the blades on their roots."""
        disk, own = getattr(self, name), [getattr(blade, name) for blade in blades]
        if disk is None or any(B is None for B in own):
            place = "disk" if disk is None else f"blade {[B is None for B in own].index(True)}"
            raise ConfigError(f"the {place} has no matrices of rotation; see rom.rotating_sector.")
        N, r, c = self.roots.shape
        d, X = len(disk), self.roots.reshape(N * r, c)
        each = list(zip(own, self.roots, strict=True))
        A = block_diag(disk, *(B[r:, r:] for B in own))
        A[:c, :c] += X.T @ np.vstack([B[:r, :r] @ Y for B, Y in each])
        A[:c, d:] += np.hstack([Y.T @ B[:r, r:] for B, Y in each])
        A[d:, :c] += np.vstack([B[r:, :r] @ Y for B, Y in each])
        return A

    def of_blades(self, blades: Sequence[ReducedBlade], Phi: Array) -> list[Array]:
        """(r + m, k) root and cantilever coordinates of every blade in k motions of the wheel.

        They are in units of the motions Phi (n, k); blades stand in the order of the N sectors.

        Raises:
            ConfigError: if Phi or the blades do not fit the wheel.
        """
        self._check(blades)
        Phi = matrix("Phi", Phi, (len(self.K) + sum(blade.n_modes for blade in blades), None))
        c = self.roots.shape[2]
        ends = len(self.K) + np.cumsum([blade.n_modes for blade in blades])
        return [
            np.vstack([Y @ Phi[:c], Phi[end - blade.n_modes : end]])
            for blade, Y, end in zip(blades, self.roots, ends, strict=True)
        ]

    def modes(
        self, blades: Sequence[ReducedBlade], n: int | None = None, *, speed: float = 0.0
    ) -> Modes:
        """Circular frequencies [rad/s] and mass-normalised modes, the n lowest; None for all.

        Frequencies (n,) ascend, rigid motions of a free wheel exactly zero; Phi is in coordinates
        of `matrices`. Coriolis forces of the speed [rad/s] are left out, see `waves`.

        Raises:
            ConfigError: see `matrices`; for a free wheel at speed.
            ModelError: if a motion is left without stiffness, by the blades or by the speed.
        """
        if speed and not self.sector.supported:
            text = "a free wheel of different blades has no modes at speed"
            raise ConfigError(f"{text}; hold the disk, or put it on rom.supported_sector.")
        K, M = self.matrices(blades, speed=speed)
        lam, Phi = _apart(K, M, self.rigid)
        if lam[0] < -RIGID_RTOL * lam[-1] or (speed and lam[0] <= 0.0):
            text = "these blades leave a motion without stiffness; look for a deviation of -1."
            if speed:
                text = f"at {speed:g} rad/s the wheel is above its instability; turn more slowly."
            raise ModelError(text)
        kept = lowest(n)
        return Modes(np.sqrt(np.maximum(lam[kept], 0.0)), Phi[:, kept])

    def waves(self, blades: Sequence[ReducedBlade], *, speed: float) -> Modes:
        """Circular frequencies [rad/s], seen from the wheel, and shapes with Coriolis forces.

        Omega (n,) ascends; complex Phi (n, n), in the coordinates of `matrices` and of unit modal
        mass, turn with exp(i omega t). The sign of the speed [rad/s] is that of the axis.

        Raises:
            ConfigError, ModelError: see `modes`.
        """
        Phi, motions = self._gyroscopic(blades, speed)
        omega, q = motions.waves()
        return Modes(omega, Phi @ q)

    def _gyroscopic(
        self, blades: Sequence[ReducedBlade], speed: float
    ) -> tuple[Array, GyroscopicModes]:
        """Modes at speed, and the motions among them that Coriolis forces leave."""
        omega, Phi = self.modes(blades, speed=speed)
        g = speed * (Phi.T @ self.coriolis_matrix(blades) @ Phi)
        return Phi, gyroscopic_modes(omega, 0.5 * (g - g.T))

    def energies(self, blades: Sequence[ReducedBlade], n: int) -> Array:
        """(n, N) share of the strain energy of the blades that each of them has [1], lowest modes.

        Raises:
            ConfigError: if there is not one blade for each sector, or one has another root.
            ModelError: if a motion has no stiffness.
        """
        _, Phi = self.modes(blades)
        moved = zip(blades, self.of_blades(blades, Phi[:, :n]), strict=True)
        each = np.array([np.einsum("am,ab,bm->m", q, blade.K, q) for blade, q in moved])
        return (each / each.sum(axis=0)).T

    def response(
        self,
        blades: Sequence[ReducedBlade],
        force: PerBlade,
        *,
        engine_order: int,
        omega: npt.ArrayLike,
        damping: Annotated[float, Between(0.0, 1.0, "()")],
        at: PerBlade,
        speed: float = 0.0,
    ) -> Complex:
        """(w, N, p) complex displacements [m] of all blades under forces that run around the wheel.

        Blade j feels force * exp(i E j alpha) * exp(i omega t) with the engine order E: for E > 0
        the wave runs against the rotation, as that of a wheel past struts at rest does. Every mode
        has the same share of critical damping; displacements are in the axes of each sector.

        Args:
            blades: N of them, in the order of the sectors.
            force: (n,) on the dofs of the model of a blade [N], or a list of N for blades of
                different models.
            engine_order: number E of disturbances around the circumference.
            omega: (w,) circular frequencies [rad/s].
            damping: share of critical damping of each mode [1].
            at: (p,) dofs of the model of a blade, or (p, n) rows, whose displacements are wanted;
                or a list of N of them.
            speed: angular speed [rad/s], with Coriolis forces.

        Raises:
            ConfigError: for a force or a place off the blades.
            ModelError: if a motion has no stiffness.
        """
        check_damping_ratio(damping, "the wheel")
        N, sweep = self.sector.n_sectors, vector("omega", omega)
        if speed:
            Phi, motions = self._gyroscopic(blades, speed)
        else:
            frequencies, Phi = self.modes(blades)
        moved = self.of_blades(blades, Phi)
        forces, rows = _each(force, N), _each(at, N)
        phase = np.exp(1j * engine_order * self.sector.angle * np.arange(N))
        load = sum(
            phase[j] * (moved[j].T @ (blade.Psi.T @ _on(blade, forces[j], j)))
            for j, blade in enumerate(blades)
        )
        if speed:
            amplitude = motions.response(load, sweep, damping)
        else:
            gap = frequencies**2 - sweep[:, None] ** 2
            amplitude = load / (gap + 2j * damping * sweep[:, None] * frequencies)
        seen = [_rows(blade, rows[j], j) @ moved[j] for j, blade in enumerate(blades)]
        return np.stack([amplitude @ row.T for row in seen], axis=1)

    def amplification(
        self, blades: Sequence[ReducedBlade], force: PerBlade, *, at: PerBlade, **sweep: Any
    ) -> float:
        """Largest amplitude of any blade, as a multiple of that of the tuned wheel [1].

        Args:
            blades: see `response`.
            force: see `response`; on the tuned wheel the first of a list acts everywhere.
            at: the amplitude is the norm of these displacements; of a list, as with the force.
            sweep: engine_order, omega, damping and speed of `response`, also of the tuned peak.

        Raises:
            ConfigError: as `response`, or if the force does not move the tuned wheel there.
        """
        found = self.response(blades, force, at=at, **sweep)
        alike = [self.sector.blade] * self.sector.n_sectors
        one, seen = (_each(what, len(alike))[0] for what in (force, at))
        tuned = self.response(alike, one, at=seen, **sweep)
        peak, reference = (float(np.linalg.norm(u, axis=-1).max()) for u in (found, tuned))
        if not reference > 0.0:
            raise ConfigError("the force does not move the tuned wheel at the dofs wanted.")
        return peak / reference


def _each(what: PerBlade, N: int) -> PerBlade:
    """One for each blade: a list of arrays, or the same for all."""
    if not isinstance(what, list) or not what or np.ndim(what[0]) == 0:
        return [what] * N
    one_each("forces or places", len(what), "blades", N)
    return what


def _on(blade: ReducedBlade, force: npt.ArrayLike, j: int) -> Array:
    f = np.asarray(force)
    one_each(f"forces on blade {j}", f.shape, "dofs of its model", (blade.Psi.shape[0],))
    off = np.flatnonzero((f != 0.0) & ~blade.Psi.any(axis=1))
    if off.size:
        raise ConfigError(f"the force on blade {j} must be zero on {off.size} dofs of the disk.")
    return f


def _rows(blade: ReducedBlade, at: npt.ArrayLike, j: int) -> Array:
    """(p, r + m) displacements wanted of the coordinates of a blade."""
    found = rows_at("at", at, blade.Psi)
    if not found.any(axis=1).all():
        raise ConfigError(f"some displacements wanted are not those of blade {j}.")
    return found


def _apart(K: Array, M: Array, rigid: Array) -> tuple[Array, Array]:
    """Squared frequencies and modes, rigid motions first and exact."""
    n, k = len(K), rigid.shape[1]
    if k == 0:
        return eigh(K, M)
    R = np.zeros((n, k))
    R[: len(rigid)] = rigid
    R = np.linalg.solve(np.linalg.cholesky(R.T @ M @ R), R.T).T
    Z = np.linalg.qr(M @ R, mode="complete")[0][:, k:]
    lam, V = eigh(Z.T @ K @ Z, Z.T @ M @ Z)
    return np.r_[np.zeros(k), lam], np.hstack([R, Z @ V])
