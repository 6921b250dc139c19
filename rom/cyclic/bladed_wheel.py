"""A disk whose blades are substructures of their own: each with its parameters, or its shape.

The disk alone is cyclic. For each harmonic n it is condensed to the roots of the blades, which move
by r_j = sum_n exp(i n j alpha) V_n a_n / sqrt(N), and a few waves with all roots held; its matrices
are diagonal in n, whatever stands on it::

    K_n = V_n^H C_n^H K C_n V_n,    C_n = [I; -K_ii^-1 K_ir]

The blades add their own matrices to the root each of them stands on. Nothing is assumed to be
small: a blade may be cracked, or another one.

Source:
    Castanier, Ottarsson and Pierre, A reduced order modeling technique for mistuned bladed disks,
    J. Vibration and Acoustics 119 (1997) 439; Castanier, Tan and Pierre, Characteristic constraint
    modes for component mode synthesis, AIAA J. 39 (2001) 1182, here of the roots of a wheel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag, eigh

from rom.cyclic.blades import ReducedBlade
from rom.cyclic.sector import Complex
from rom.cyclic.substructures import SubstructuredSector
from rom.errors import ConfigError, ModelError
from rom.model import Array

RIGID = 1e-9  # of the largest squared frequency: what is less negative is a rigid motion


@dataclass(frozen=True)
class BladedWheel:
    """A disk without blades, ready for any set of them.

    Attributes:
        sector: the sector of the tuned wheel.
        K: (d, d) stiffness of the disk in c coordinates of the roots, then mass-normalised waves
            with all roots held.
        M: (d, d) its mass.
        roots: (N, r, c) how the roots of the blades move by these coordinates.
    """

    sector: SubstructuredSector
    K: Array
    M: Array
    roots: Array

    def matrices(self, blades: Sequence[ReducedBlade]) -> tuple[Array, Array]:
        """Stiffness and mass of the wheel: disk, then the cantilever modes of all blades.

        Raises:
            ConfigError: if there is not one blade for each sector, or one has another root.
        """
        N, r, c = self.roots.shape
        if len(blades) != N or any(blade.n_root != r for blade in blades):
            raise ConfigError(
                f"{len(blades)} blades, with {sorted({b.n_root for b in blades})} root "
                f"coordinates: give {N} with {r}.",
                hint="Take sector.blade, its varied(…), or rom.reduced_blade(sector, …).",
            )
        X = self.roots.reshape(N * r, c)
        K, M = (
            block_diag(disk, *(A[r:, r:] for A in own))
            for disk, own in ((self.K, [b.K for b in blades]), (self.M, [b.M for b in blades]))
        )
        K[:c, :c] += X.T @ np.vstack(
            [b.K[:r, :r] @ Y for b, Y in zip(blades, self.roots, strict=True)]
        )
        M[:c, :c] += X.T @ np.vstack(
            [b.M[:r, :r] @ Y for b, Y in zip(blades, self.roots, strict=True)]
        )
        across = np.hstack([Y.T @ b.M[:r, r:] for b, Y in zip(blades, self.roots, strict=True)])
        d = len(self.K)
        M[:c, d:] = across
        M[d:, :c] = across.T
        return K, M

    def of_blades(self, blades: Sequence[ReducedBlade], Phi: Array) -> list[Array]:
        """(r + m, k) per blade: root and cantilever coordinates in k motions Phi (n, k)."""
        c = self.roots.shape[2]
        ends = len(self.K) + np.cumsum([blade.n_modes for blade in blades])
        return [
            np.vstack([Y @ Phi[:c], Phi[end - blade.n_modes : end]])
            for blade, Y, end in zip(blades, self.roots, ends, strict=True)
        ]

    def modes(self, blades: Sequence[ReducedBlade]) -> tuple[Array, Array]:
        """Circular frequencies [rad/s] and mass-normalised modes of the wheel with these blades.

        Args:
            blades: N of them, in the order of the sectors.

        Returns:
            omega (n,), ascending, and Phi (n, n) in the coordinates of `matrices`.

        Raises:
            ConfigError: see `matrices`.
            ModelError: if a motion is left without stiffness.
        """
        lam, Phi = eigh(*self.matrices(blades))
        if lam[0] < -RIGID * lam[-1]:
            raise ModelError("these blades leave a motion without stiffness.")
        return np.sqrt(np.maximum(lam, 0.0)), Phi

    def energies(self, blades: Sequence[ReducedBlade], n: int) -> Array:
        """(n, N) share of the strain energy of the blades that each of them has, lowest modes."""
        _, Phi = self.modes(blades)
        each = np.array([np.einsum("am,ab,bm->m", q, blade.K, q)
                         for blade, q in zip(blades, self.of_blades(blades, Phi[:, :n]),
                                             strict=True)])  # fmt: skip
        found: Array = (each / each.sum(axis=0)).T
        return found

    def response(
        self,
        blades: Sequence[ReducedBlade],
        force: Any,
        *,
        engine_order: int,
        omega: npt.ArrayLike,
        damping: float,
        at: Any,
    ) -> Complex:
        """Answer of all blades to forces that travel around the wheel.

        Blade j feels force * exp(i E j alpha) * exp(i omega t) with the engine order E; every mode
        of the wheel has the same share of critical damping.

        Args:
            blades: N of them, in the order of the sectors.
            force: (n,) on the dofs of the model of a blade [N], or a list of N for blades of
                different models.
            engine_order: number E of disturbances around the circumference.
            omega: (w,) circular frequencies [rad/s].
            damping: share of critical damping of each mode.
            at: (p,) dofs of the model of a blade, or (p, n) rows, whose displacements are wanted;
                or a list of N of them.

        Returns:
            (w, N, p) complex displacements [m], in the axes of each sector.

        Raises:
            ConfigError: for damping that is not positive, or a force or place off the blades.
        """
        if not damping > 0.0:
            raise ConfigError(
                f"damping = {damping!r} must be a positive share of critical damping."
            )
        N, sweep = self.sector.n_sectors, np.atleast_1d(np.asarray(omega, dtype=float))
        frequencies, Phi = self.modes(blades)
        moved = self.of_blades(blades, Phi)
        forces, rows = _each(force, N), _each(at, N)
        phase = np.exp(1j * engine_order * self.sector.angle * np.arange(N))
        load = sum(
            phase[j] * (q.T @ (blade.Psi.T @ _on(blade, forces[j], j)))
            for j, (blade, q) in enumerate(zip(blades, moved, strict=True))
        )
        gap = frequencies**2 - sweep[:, None] ** 2
        amplitude = load / (gap + 2j * damping * sweep[:, None] * frequencies)
        seen = [_rows(blade, rows[j], j) @ moved[j] for j, blade in enumerate(blades)]
        return np.stack([amplitude @ row.T for row in seen], axis=1)

    def amplification(
        self, blades: Sequence[ReducedBlade], force: Any, *, at: Any, **sweep: Any
    ) -> float:
        """Largest amplitude of any blade, as a multiple of that of the tuned wheel.

        Args:
            blades: see `response`.
            force: see `response`; on the tuned wheel the first of a list acts everywhere.
            at: the amplitude is the norm of these displacements; of a list, as with the force.
            sweep: engine_order, omega and damping of `response`; the tuned peak is found in the
                same sweep.
        """
        found = self.response(blades, force, at=at, **sweep)
        alike = [self.sector.blade] * self.sector.n_sectors
        one, seen = (_each(what, len(alike))[0] for what in (force, at))
        tuned = self.response(alike, one, at=seen, **sweep)
        peak, reference = (float(np.linalg.norm(u, axis=-1).max()) for u in (found, tuned))
        if not reference > 0.0:
            raise ConfigError("the force does not move the tuned wheel at the dofs wanted.")
        return peak / reference


def _each(what: Any, N: int) -> list[Any]:
    """One for each blade: a list of arrays, or the same for all.

    Raises:
        ConfigError: if a list has another length.
    """
    if not isinstance(what, list) or np.ndim(what[0]) == 0:
        return [what] * N
    if len(what) != N:
        raise ConfigError(f"a list of {len(what)} forces or places: give {N}, one for each blade.")
    return what


def _on(blade: ReducedBlade, force: npt.ArrayLike, j: int) -> Array:
    f = np.asarray(force)
    if f.shape != (blade.Psi.shape[0],):
        raise ConfigError(
            f"the force on blade {j} has the shape {f.shape}, its model {blade.Psi.shape[0]} dofs."
        )
    off = np.flatnonzero((f != 0.0) & ~blade.Psi.any(axis=1))
    if off.size:
        raise ConfigError(f"the force on blade {j} acts on {off.size} dofs that are not its own.")
    return f


def _rows(blade: ReducedBlade, at: npt.ArrayLike, j: int) -> Array:
    """(p, r + m) displacements wanted of the coordinates of a blade."""
    rows = np.asarray(at)
    found = np.asarray(rows @ blade.Psi) if rows.ndim == 2 else blade.Psi[rows.astype(np.int64)]
    if not found.any(axis=1).all():
        raise ConfigError(f"some displacements wanted are not those of blade {j}.")
    return found


def bladed_wheel(
    sector: SubstructuredSector, n_waves: int, *, n_root: int | None = None
) -> BladedWheel:
    """The disk of a substructured sector, on which each blade may be another one.

    Args:
        sector: made by `rom.substructured_sector`.
        n_waves: number of waves of the disk for each number of nodal diameters, roots held.
        n_root: number of shapes of the roots for each, the lowest of the statically condensed
            tuned wheel (characteristic constraint modes); all of them unless given.

    Raises:
        ConfigError: if the disk has not so many.
    """
    j = np.arange(sector.n_sectors)
    Ks: list[Array] = []
    Ms: list[Array] = []
    couplings: list[Array] = []
    waves, roots = [], []
    for n in sector.diameters:
        standing = sector.standing(n)
        K, M, omega, B = _condensed(sector, n, n_waves)
        V = _root_shapes(sector, K, M, n_root)
        for found, A in ((Ks, K @ V), (Ms, M @ V), (couplings, B)):
            found.append(_real(V.conj().T @ A, standing))
        waves += [omega] if standing else [omega, omega]
        moved = np.exp(1j * n * sector.angle * j)[:, None, None] * V
        size = np.sqrt((1 if standing else 2) / sector.n_sectors)
        roots += [size * part for part in (moved.real, moved.imag)[: 1 if standing else 2]]
    L, omega = block_diag(*couplings), np.concatenate(waves)
    return BladedWheel(
        sector,
        block_diag(*Ks, np.diag(omega**2)),
        np.block([[block_diag(*Ms), L], [L.T, np.eye(omega.size)]]),
        np.concatenate(roots, axis=2),
    )


def _real(A: Complex, standing: bool) -> Array:
    """Of a_n^H A b_n and its conjugate for -n, in (a', a'') of a_n = (a' - i a'') / sqrt(2)."""
    return A.real if standing else np.block([[A.real, A.imag], [-A.imag, A.real]])


def _root_shapes(
    sector: SubstructuredSector, K: Complex, M: Complex, n_root: int | None
) -> Complex:
    """(r, c) shapes of the roots: all, or the lowest with the nominal blades on them."""
    r = len(K)
    if n_root is None:
        return np.eye(r, dtype=complex)
    if isinstance(n_root, bool) or not 1 <= n_root <= r:
        raise ConfigError(f"n_root = {n_root!r}: a root has 1 to {r} shapes.")
    static = (A[:r, :r] for A in (sector.blade.K, sector.blade.M))
    V = eigh(*(A + own for A, own in zip((K, M), static, strict=True)))[1]
    return np.asarray(V[:, :n_root], dtype=complex)


def _condensed(
    sector: SubstructuredSector, n: int, n_waves: int
) -> tuple[Complex, Complex, Array, Complex]:
    """Stiffness and mass (r, r) of roots, waves (w,) with roots held, and their coupling (r, w)."""
    kept = np.isin(sector.free, sector.cantilever, invert=True)
    T = sector.harmonic(n)[:, kept].toarray()
    root = np.searchsorted(sector.free[kept], sector.root)
    inner = np.setdiff1d(np.arange(T.shape[1]), root)
    if isinstance(n_waves, bool) or not 0 <= n_waves <= inner.size:
        raise ConfigError(f"n_waves = {n_waves!r}: the disk has 0 to {inner.size} with roots held.")
    K, M = (T.conj().T @ A @ T for A in _disk(sector))
    K_ii = K[np.ix_(inner, inner)]
    C: Complex = np.zeros((T.shape[1], root.size), dtype=complex)
    C[root] = np.eye(root.size)
    C[inner] = -np.linalg.solve(K_ii, K[np.ix_(inner, root)])
    square, Phi = eigh(K_ii, M[np.ix_(inner, inner)])
    B = C.conj().T @ M[:, inner] @ Phi[:, :n_waves]
    return C.conj().T @ K @ C, C.conj().T @ M @ C, np.sqrt(square[:n_waves]), B


def _disk(sector: SubstructuredSector) -> tuple[Array, Array]:
    """Stiffness and mass of the sector without its blade."""
    at = np.r_[sector.root, sector.cantilever]
    found = []
    for A, blade in ((sector.K, sector.blade.K), (sector.M, sector.blade.M)):
        disk = A.toarray()
        disk[np.ix_(at, at)] -= blade
        found.append(disk)
    return found[0], found[1]
