"""Blades that differ: component mode mistuning, and the response to a wave of forces.

The modes of the tuned wheel, waves Phi_n with n nodal diameters, span the motion of the mistuned
one. A blade whose stiffness is (1 + delta_j) times the nominal one couples them: with all waves
normalised on the wheel::

    K_mn = omega_n^2 delta_mn + c_(n - m) N Phi_m^H K_blade Phi_n,
    c_k = 1/N sum_j delta_j exp(i k j alpha)

so that a new set of blades costs a Fourier transform and an eigenvalue problem of the size of the
frequency band, whatever the mesh. Modes of a wheel whose blades are all a little stiffer join the
basis; they show how shapes change with a blade, so that errors are of second order in delta.
"""

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from rom.arguments import Positive, lowest, matrix, one_each, rows_at, typed, vector
from rom.components.wheels.modes import cyclic_modes, spinning
from rom.components.wheels.reduced import rows_of_wheel
from rom.components.wheels.sector import Complex, CyclicSector, Matrix, each_diameter
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index, Modes, Report, Row
from rom.names import check_known
from rom.plausible import check_damping_ratio
from rom.process.spreading import spread

STIFFER_BLADES = 0.05  # of all blades: the wheel stays cyclic, so that its truth is one sector
STIFFNESS_CHANGE = 0.1  # of all blades, relative, that enriches the basis
NEW_SHARE_TOL = 1e-12  # squared share of a mode that is new, below which it is round-off
Damping = Annotated[float, Positive()]  # share of the critical one
AT_ONCE = 1_000_000  # complex numbers held by one batch of wheels


@typed
@dataclass(frozen=True)
class MistunedWheel:
    """A wheel in the coordinates of its tuned modes, ready for any set of blades.

    Attributes:
        sector: the sector.
        harmonics: (r,) number n of each wave, -N / 2 < n <= N / 2.
        omega: (r,) circular frequencies of the tuned wheel [rad/s].
        shapes: (n, r) complex, mass-normalised shapes of sector 0 [kg^-1/2]; sector j moves by
            exp(i n j alpha) times that.
        blade: (r, r) Hermitian, N Phi^H K_blade Phi of one blade [1/s^2].
        blade_stiffness: (n, n) K_blade in the dofs of the sector [N/m].
        speed: angular speed of the tuned modes [rad/s].
    """

    sector: CyclicSector
    harmonics: Index
    omega: Array
    shapes: Complex
    blade: Complex
    blade_stiffness: Matrix
    speed: float = 0.0

    @cached_property
    def certificate(self) -> Report:
        """Wheels with all blades a little stiffer or softer against the sector, full or reduced."""
        rows: list[Row] = []
        for change in (STIFFER_BLADES, -STIFFER_BLADES):
            exact = replace(self.sector, K=self.sector.K + change * self.blade_stiffness)
            found = self.modes(np.full(self.sector.n_sectors, change)).frequencies
            rows += rows_of_wheel(f"all blades {100 * change:+g} %", found, exact, self.speed)
        return Report("certificate of the mistuned wheel", tuple(rows))

    def stiffness(self, deviations: npt.ArrayLike) -> Complex:
        """(..., r, r) Hermitian stiffness in mass-normalised waves [1/s^2].

        Deviations (..., N) are those of the stiffness of the blades, relative [1].

        Raises:
            ConfigError: if there is not one number above -1 for each blade.
        """
        delta = np.asarray(deviations, dtype=float)
        N = self.sector.n_sectors
        if delta.shape[-1:] != (N,) or not np.isfinite(delta).all() or delta.min() <= -1.0:
            raise ConfigError(f"deviations {delta.shape}; give {N} above -1, one per blade.")
        waves = np.fft.ifft(delta, axis=-1)  # 1/N sum_j delta_j exp(+i k j alpha)
        k = (self.harmonics[None, :] - self.harmonics[:, None]) % N
        return waves[..., k] * self.blade + np.diag(self.omega**2)

    def modes(self, deviations: npt.ArrayLike, n: int | None = None) -> Modes:
        """Frequencies [rad/s] (..., n) and modes in waves (..., r, n) of mistuned wheels.

        Args:
            deviations: (..., N) relative deviations of the stiffness of the blades [1].
            n: number of modes, lowest first; None for all r.

        Raises:
            ModelError: if a deviation leaves a motion without stiffness.
            ConfigError: if there is not one number above -1 for each blade.
        """
        lam, V = np.linalg.eigh(self.stiffness(deviations))
        if lam.min() < -1e-9 * lam.max():
            least = np.min(deviations)
            raise ModelError(f"deviations from {least:g} on leave a motion without stiffness.")
        kept = lowest(n)
        return Modes(np.sqrt(np.maximum(lam[..., kept], 0.0)), V[..., kept])

    def response(
        self,
        deviations: npt.ArrayLike,
        force: npt.ArrayLike | Complex,
        *,
        engine_order: int,
        omega: npt.ArrayLike,
        damping: Damping,
        at: npt.ArrayLike,
    ) -> Complex:
        """(w, N, p) complex displacements [m] of all blades under forces that run around the wheel.

        Sector j feels force * exp(i E j alpha) * exp(i omega t) with the engine order E; every
        mode of the mistuned wheel has the same share of critical damping.

        Args:
            deviations: (N,) relative deviations of the stiffness of the blades [1].
            force: (n,) force on the dofs of a sector, in its own axes [N]; complex if phases
                differ.
            engine_order: number E of disturbances around the circumference.
            omega: (w,) circular frequencies [rad/s].
            damping: share of critical damping of each mode [1].
            at: (p,) dof numbers of a sector, or (p, n) rows [1], whose displacements are wanted.

        Raises:
            ConfigError: for wrong deviations, or damping that is not positive.
            ModelError: if a deviation leaves a motion without stiffness.
        """
        drive, rows = self._drive(force, engine_order), rows_at("at", at, self.shapes)
        lam, V = self.modes(deviations)
        q = self._modal(lam, V, drive, vector("omega", omega), damping)  # (w, r)
        return self._seen(q @ V.T, rows)

    def amplification(
        self,
        deviations: npt.ArrayLike,
        force: npt.ArrayLike | Complex,
        *,
        engine_order: int,
        omega: npt.ArrayLike,
        damping: Damping,
        at: npt.ArrayLike,
        executor: Executor | None = None,
    ) -> Array:
        """(s,) largest amplitudes of any blade of mistuned wheels, over that of the tuned one [1].

        Deviations (s, N) have one row per wheel; in the sweep omega (w,) over the resonances
        [rad/s] the tuned peak is found too; the amplitude of a blade is the norm of the
        displacements ``at``. Workers of an executor of `concurrent.futures` share the wheels, if
        one is given. Otherwise arguments are as of `response`.

        Raises:
            ConfigError: as `response`, or if the force does not move the tuned wheel there.
        """
        many = np.atleast_2d(np.asarray(deviations, dtype=float))
        N, sweep = self.sector.n_sectors, vector("omega", omega)
        drive, rows = self._drive(force, engine_order), rows_at("at", at, self.shapes)
        tuned = self._peaks(np.zeros((1, N)), drive, sweep, damping, rows)[0]
        if not tuned > 0.0:
            raise ConfigError("the force does not move the tuned wheel at the dofs wanted.")
        batch = max(1, AT_ONCE // (sweep.size * N * max(rows.shape[0], self.omega.size // N + 1)))
        batches = [many[first : first + batch] for first in range(0, len(many), batch)]
        peak = partial(self._peaks, drive=drive, sweep=sweep, zeta=damping, rows=rows)
        peaks = spread(peak, batches, executor)
        return np.concatenate(peaks) / tuned

    def _drive(self, force: npt.ArrayLike | Complex, engine_order: int) -> Complex:
        """(r,) force on each wave: N times that on its sector, if the harmonics agree."""
        f = np.asarray(force)
        one_each("forces", f.shape, "dofs of the sector", (self.sector.n,))
        N = self.sector.n_sectors
        met = (self.harmonics - engine_order) % N == 0
        return np.where(met, N * (self.shapes.conj().T @ f), 0.0)

    def _modal(self, w: Array, V: Complex, drive: Complex, sweep: Array, zeta: float) -> Complex:
        """(..., w, r) modal amplitudes."""
        check_damping_ratio(zeta, "the wheel")
        load = np.einsum("...km,k->...m", V.conj(), drive)
        gap = w[..., None, :] ** 2 - sweep[:, None] ** 2
        return load[..., None, :] / (gap + 2j * zeta * sweep[:, None] * w[..., None, :])

    def _seen(self, q: Complex, rows: Complex) -> Complex:
        """(..., N, p) displacements of all sectors from amplitudes of waves (..., r)."""
        N = self.sector.n_sectors
        spread = np.exp(2j * np.pi / N * np.outer(self.harmonics, np.arange(N)))
        reach = (spread[:, :, None] * rows.T[:, None]).reshape(self.omega.size, -1)
        return (q @ reach).reshape(*q.shape[:-1], N, -1)

    def _peaks(
        self, many: Array, drive: Complex, sweep: Array, zeta: float, rows: Complex
    ) -> Array:
        w, V = self.modes(many)
        q = self._modal(w, V, drive, sweep, zeta) @ np.swapaxes(V, -1, -2)
        return np.linalg.norm(self._seen(q, rows), axis=-1).max(axis=(1, 2))


@typed
def mistuned_wheel(
    sector: CyclicSector, n: int, *, blade: Matrix = "blade", speed: float = 0.0
) -> MistunedWheel:
    """Tuned modes of a wheel, to which blades that differ are then added.

    Under mpirun the ranks share the numbers of nodal diameters, and all must call.

    Args:
        sector: full or reduced.
        n: number of families: modes per number of nodal diameters, as many as the band has.
        blade: name of a region of the sector, or (n, n) stiffness of a blade alone [N/m].
        speed: angular speed that stiffens the tuned modes [rad/s]; Coriolis forces are left out.

    Raises:
        ConfigError: if the region is unknown.
        ModelError, ModesMissedError: see `cyclic_modes`.

    Source:
        Lim, Bladh, Castanier and Pierre, Compact, generalized component mode mistuning
        representation for modeling bladed disk vibration, AIAA J. 45 (2007) 2285.
    """
    if isinstance(blade, str):
        check_known(blade, sector.regions, f"the sector has no region {blade!r}; it has")
        blade = sector.regions[blade]
    K_blade = matrix("blade", blade, (sector.n, sector.n))
    N = sector.n_sectors
    harmonics, omega, shapes = [], [], []
    tuned = each_diameter(sector, lambda d: _tuned(sector, K_blade, d, n, speed))
    for d, (lam, U) in zip(sector.diameters, tuned, strict=True):
        for sign in (1,) if sector.standing(d) else (1, -1):
            harmonics += [sign * d] * lam.size
            omega.append(np.sqrt(np.maximum(lam, 0.0)))
            shapes.append(U if sign > 0 else U.conj())
    Phi = np.hstack(shapes) / np.sqrt(N)
    numbers = np.array(harmonics, dtype=np.int64)
    B = N * (Phi.conj().T @ (K_blade @ Phi))
    waves = (sector, numbers, np.concatenate(omega), Phi)
    return MistunedWheel(*waves, 0.5 * (B + B.conj().T), K_blade, speed)


def _tuned(
    sector: CyclicSector, K_blade: Matrix, diameter: int, n: int, speed: float
) -> tuple[Array, Complex]:
    """Squared frequencies and shapes in the space of tuned modes and those with stiffer blades."""
    stiffer = replace(sector, K=sector.K + STIFFNESS_CHANGE * K_blade)
    Phi, more = (cyclic_modes(s, diameter, n, speed=speed).shapes for s in (sector, stiffer))
    for _ in range(2):
        more = more - Phi @ (Phi.conj().T @ (sector.M @ more))
    weight, V = np.linalg.eigh(more.conj().T @ (sector.M @ more))
    new = weight > NEW_SHARE_TOL
    Z = np.hstack([Phi, more @ (V[:, new] / np.sqrt(weight[new]))])
    lam, V = eigh(Z.conj().T @ (spinning(sector, speed) @ Z), Z.conj().T @ (sector.M @ Z))
    return lam, Z @ V


def whitehead(n_sectors: int) -> float:
    """Largest amplification one family of blade modes can reach, (1 + sqrt(N)) / 2 [1].

    Source:
        Whitehead, The maximum factor by which forced vibration of blades can increase due to
        mistuning, J. Eng. Gas Turbines Power 120 (1998) 115.
    """
    return 0.5 * (1 + np.sqrt(n_sectors))
