"""A disk whose blades are substructures of their own: each with its parameters, or its shape.

The disk alone is cyclic. Each of its harmonics n is condensed to the roots of the blades and a few
waves with all roots held; the roots then go back from waves r_n to blades r_j::

    K_jl = 1/N sum_n exp(i n (j - l) alpha) C_n^H K_n C_n,    C_n = [I; -K_ii^-1 K_ir]

which is block-circulant, whatever stands on the disk. The blades add their own matrices to the root
each of them stands on. Nothing is assumed to be small: a blade may be cracked, or another one.

Source:
    Castanier, Ottarsson and Pierre, A reduced order modeling technique for mistuned bladed disks,
    J. Vibration and Acoustics 119 (1997) 439; on the disk with waves and fixed roots ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from rom.cyclic.blades import ReducedBlade
from rom.cyclic.sector import Complex
from rom.cyclic.substructures import SubstructuredSector
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index

RIGID = 1e-9  # of the largest squared frequency: what is less negative is a rigid motion


@dataclass(frozen=True)
class BladedWheel:
    """A disk without blades, ready for any set of them.

    Attributes:
        sector: the sector of the tuned wheel.
        K: (d, d) stiffness of the disk; coordinates are the roots of blades 0 to N - 1, then
            mass-normalised waves with all roots held.
        M: (d, d) its mass.
    """

    sector: SubstructuredSector
    K: Array
    M: Array

    def places(self, blades: Sequence[ReducedBlade]) -> list[Index]:
        """Coordinates of each blade in those of the wheel: its root, then its cantilever modes.

        Raises:
            ConfigError: if there is not one blade for each sector, or one has another root.
        """
        N, r = self.sector.n_sectors, self.sector.root.size
        if len(blades) != N or any(blade.n_root != r for blade in blades):
            raise ConfigError(
                f"{len(blades)} blades, with {sorted({b.n_root for b in blades})} root "
                f"coordinates: give {N} with {r}.",
                hint="Take sector.blade, its varied(…), or rom.reduced_blade(sector, …).",
            )
        first = len(self.K) + np.cumsum([0, *(blade.n_modes for blade in blades)])
        return [np.r_[j * r : (j + 1) * r, first[j] : first[j + 1]] for j in range(N)]

    def matrices(self, blades: Sequence[ReducedBlade]) -> tuple[Array, Array]:
        """Stiffness and mass of the wheel: disk, then the cantilever modes of all blades."""
        places = self.places(blades)
        d = len(self.K)
        n = d + sum(blade.n_modes for blade in blades)
        K, M = np.zeros((n, n)), np.zeros((n, n))
        K[:d, :d], M[:d, :d] = self.K, self.M
        for blade, at in zip(blades, places, strict=True):
            K[np.ix_(at, at)] += blade.K
            M[np.ix_(at, at)] += blade.M
        return K, M

    def modes(self, blades: Sequence[ReducedBlade]) -> tuple[Array, Array]:
        """Circular frequencies [rad/s] and mass-normalised modes of the wheel with these blades.

        Args:
            blades: N of them, in the order of the sectors.

        Returns:
            omega (n,), ascending, and Phi (n, n) in the coordinates of `matrices`.

        Raises:
            ConfigError: see `places`.
            ModelError: if a motion is left without stiffness.
        """
        lam, Phi = eigh(*self.matrices(blades))
        if lam[0] < -RIGID * lam[-1]:
            raise ModelError("these blades leave a motion without stiffness.")
        return np.sqrt(np.maximum(lam, 0.0)), Phi

    def energies(self, blades: Sequence[ReducedBlade], n: int) -> Array:
        """(n, N) share of the strain energy of the blades that each of them has, lowest modes."""
        _, Phi = self.modes(blades)
        places = self.places(blades)
        each = np.array([np.einsum("am,ab,bm->m", Phi[at, :n], blade.K, Phi[at, :n])
                         for blade, at in zip(blades, places, strict=True)])  # fmt: skip
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
        places = self.places(blades)
        forces, rows = _each(force, N), _each(at, N)
        phase = np.exp(1j * engine_order * self.sector.angle * np.arange(N))
        load = sum(
            phase[j] * (Phi[places[j]].T @ (blades[j].Psi.T @ _on(blades[j], forces[j], j)))
            for j in range(N)
        )
        gap = frequencies**2 - sweep[:, None] ** 2
        q = load / (gap + 2j * damping * sweep[:, None] * frequencies)
        seen = [_rows(blade, rows[j], j) @ Phi[places[j]] for j, blade in enumerate(blades)]
        return np.stack([q @ row.T for row in seen], axis=1)

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


def bladed_wheel(sector: SubstructuredSector, n_waves: int) -> BladedWheel:
    """The disk of a substructured sector, on which each blade may be another one.

    Args:
        sector: made by `rom.substructured_sector`.
        n_waves: number of waves of the disk for each number of nodal diameters, roots held; of
            those above twice the highest frequency of interest a few are enough.

    Raises:
        ConfigError: if the disk has not so many.
    """
    N, r = sector.n_sectors, sector.root.size
    K, M, omega, coupling = np.zeros((N, r, N, r)), np.zeros((N, r, N, r)), [], []
    apart = np.subtract.outer(np.arange(N), np.arange(N))
    for n in sector.diameters:
        K_n, M_n, w, B = _condensed(sector, n, n_waves)
        pair = 1 if sector.standing(n) else 2
        turn = np.exp(1j * n * sector.angle * apart)
        for whole, part in ((K, K_n), (M, M_n)):
            whole += pair / N * np.einsum("jl,ab->jalb", turn, part).real
        wave = np.sqrt(pair / N) * np.einsum("j,aw->jaw", turn[:, 0], B).reshape(N * r, -1)
        for side in (wave.real, wave.imag)[:pair]:
            omega.append(w)
            coupling.append(side)
    lam, L = np.concatenate(omega) ** 2, np.hstack(coupling)
    K_disk, M_disk = (A.reshape(N * r, N * r) for A in (K, M))
    zero = np.zeros(L.shape)
    return BladedWheel(
        sector,
        np.block([[K_disk, zero], [zero.T, np.diag(lam)]]),
        np.block([[M_disk, L], [L.T, np.eye(lam.size)]]),
    )


def _condensed(
    sector: SubstructuredSector, n: int, n_waves: int
) -> tuple[Complex, Complex, Array, Complex]:
    """Stiffness and mass (r, r) of roots, waves (w,) with roots held, and their coupling (r, w)."""
    T = sector.harmonic(n)[:, np.isin(sector.free, sector.cantilever, invert=True)].toarray()
    root = np.flatnonzero(T[sector.root].any(axis=0))
    inner = np.setdiff1d(np.arange(T.shape[1]), root)
    if isinstance(n_waves, bool) or not 0 <= n_waves <= inner.size:
        raise ConfigError(f"n_waves = {n_waves!r}: the disk has 0 to {inner.size} with roots held.")
    K, M = (T.conj().T @ A @ T for A in _disk(sector))
    K_ii, K_ir = K[np.ix_(inner, inner)], K[np.ix_(inner, root)]
    C = np.zeros((T.shape[1], root.size), dtype=T.dtype)
    C[root] = np.eye(root.size)
    C[inner] = -np.linalg.solve(K_ii, K_ir)
    omega2, Phi = eigh(K_ii, M[np.ix_(inner, inner)])
    B = C.conj().T @ M[:, inner] @ Phi[:, :n_waves]
    return C.conj().T @ K @ C, C.conj().T @ M @ C, np.sqrt(omega2[:n_waves]), B


def _disk(sector: SubstructuredSector) -> tuple[Array, Array]:
    """Stiffness and mass of the sector without its blade."""
    at = np.r_[sector.root, sector.cantilever]
    found = []
    for A, blade in ((sector.K, sector.blade.K), (sector.M, sector.blade.M)):
        disk = A.toarray()
        disk[np.ix_(at, at)] -= blade
        found.append(disk)
    return found[0], found[1]
