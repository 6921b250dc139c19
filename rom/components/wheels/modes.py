"""Modes of a wheel by nodal diameters, from a real system of twice the size of a sector."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import block_diag, bmat, csr_matrix

from rom.arguments import typed, whole
from rom.components.wheels.rotation import divergence_speed
from rom.components.wheels.sector import Complex, CyclicSector, each_diameter
from rom.eigen.scipy import negative_count
from rom.eigen.workers import Workers
from rom.errors import ConfigError, ModelError
from rom.model import Array, Modes

N_SPARE_MODES = 2  # beyond those asked for, so that no pair is cut


@typed
@dataclass(frozen=True, kw_only=True)
class CyclicModes(Modes):
    """Modes of a wheel with the same number of nodal diameters.

    Each stands for two modes of the wheel, its real and imaginary part, which one can add up to a
    wave that travels either way; with 0 and N / 2 diameters for one.

    Attributes:
        omega: (m,) circular frequencies [rad/s]; rigid motions are exactly zero.
        shapes: (n, m) complex displacements of sector 0, mass-normalised.
        sector: the sector.
        diameter: number of nodal diameters.
    """

    sector: CyclicSector
    diameter: int

    @property
    def multiplicity(self) -> int:
        """How often the wheel has each frequency: 1 or 2."""
        return 1 if self.sector.standing(self.diameter) else 2

    def on_wheel(self, phase: float = 0.0) -> Array:
        """(N, n, m) real shapes on all sectors, see `CyclicSector.on_wheel`."""
        return self.sector.on_wheel(self.shapes, self.diameter, phase)


@typed
def cyclic_modes(sector: CyclicSector, diameter: int, n: int, *, speed: float = 0.0) -> CyclicModes:
    """Lowest modes of a wheel with a number of nodal diameters.

    The wave u = a + i b of a real sector obeys a real symmetric system of twice its size, whose
    frequencies come in pairs; none is lost, as the inertia count of that system shows.

    Args:
        sector: one sector.
        diameter: number of nodal diameters, 0 to N / 2.
        n: number of modes.
        speed: angular speed [rad/s]; stiffens and softens the wheel, Coriolis forces left out, see
            `travelling_modes`.

    Raises:
        ConfigError: if the wheel cannot have the diameters or the modes, or has no matrices of
            rotation.
        ModelError: if rotation leaves no stiffness.
        ModesMissedError: if a count says that a mode was skipped.

    Source:
        Thomas, Dynamics of rotationally periodic structures, Int. J. Numer. Meth. Engng. 14 (1979).

    Example:
        >>> K, M = csr_matrix([[2.0, -1.0], [-1.0, 2.0]]), csr_matrix(np.eye(2) / 2)
        >>> one = csr_matrix([[1.0]])  # a ring of masses m = 1, to the ground k = 2, between c = 1
        >>> slave, master = np.array([1]), np.array([0])
        >>> ring = rom.CyclicSector(12, K, M, slave=slave, master=master, coupling=one)
        >>> (rom.cyclic_modes(ring, 6, 1).omega ** 2).round(6)  # (k + 4 c sin^2(pi n / N)) / m
        array([6.])
    """
    n = whole("n", n, 1, sector.free.size)
    T = sector.harmonic(sector.checked(diameter))
    K, R, held = spinning(sector, speed), sector.rigid(diameter)[sector.free], sector.supported
    if speed:
        _refuse_divergence(sector, diameter, K, speed)
        R = R[:, :0]
    if sector.standing(diameter):
        A, B = (T.T @ matrix @ T for matrix in (K, sector.M))
        omega, real = _real(sector.workers, A, B, real_span(R), n, held=held)
        shapes = (T @ real).astype(complex)
        return CyclicModes(omega, shapes, sector=sector, diameter=diameter)
    parts = real_form(T)
    K_2, M_2 = (parts.T @ block_diag([A, A], format="csr") @ parts for A in (K, sector.M))
    rigid = np.hstack([_stacked(R), _stacked(1j * R)])
    _, pairs = _real(sector.workers, K_2, M_2, rigid, 2 * (n + N_SPARE_MODES), held=held)
    omega, shapes = _waves(T, K, sector.M, pairs, rigid.shape[1], n)
    return CyclicModes(omega, T @ shapes, sector=sector, diameter=diameter)


@typed
def wheel_modes(
    sector: CyclicSector, n: int, *, diameters: Sequence[int] | None = None, speed: float = 0.0
) -> tuple[CyclicModes, ...]:
    """Lowest modes of a wheel with each number of nodal diameters, in the order given.

    Under mpirun the numbers are shared among the ranks, each of which finds the modes of its own;
    all ranks must call, and all get all modes.

    Args:
        sector: one sector.
        n: number of modes with each number of nodal diameters.
        diameters: numbers of nodal diameters; all the wheel can have, 0 to N / 2, unless given.
        speed: angular speed [rad/s], see `cyclic_modes`.

    Raises:
        ConfigError, ModelError, ModesMissedError: on all ranks, see `cyclic_modes`.

    Example:
        >>> K, M = csr_matrix([[2.0, -1.0], [-1.0, 2.0]]), csr_matrix(np.eye(2) / 2)
        >>> one = csr_matrix([[1.0]])  # a ring of masses m = 1, to the ground k = 2, between c = 1
        >>> slave, master = np.array([1]), np.array([0])
        >>> ring = rom.CyclicSector(6, K, M, slave=slave, master=master, coupling=one)
        >>> [round(float(m.omega[0]) ** 2, 6) for m in rom.wheel_modes(ring, 1)]
        [2.0, 3.0, 5.0, 6.0]
    """
    chosen = list(sector.diameters if diameters is None else diameters)

    def found(diameter: int) -> tuple[Array, Complex]:
        modes = cyclic_modes(sector, diameter, n, speed=speed)
        return modes.omega, modes.shapes

    each = zip(chosen, each_diameter(sector, found, chosen), strict=True)
    return tuple(CyclicModes(*pair, sector=sector, diameter=d) for d, pair in each)


def _refuse_divergence(sector: CyclicSector, diameter: int, K: csr_matrix, speed: float) -> None:
    if sector.motions is not None:
        raise ConfigError("a free wheel at speed has no modes; use rom.travelling_modes.")
    T = sector.harmonic(diameter)
    K = csr_matrix(T.conj().T @ K @ T)
    if negative_count(K if sector.standing(diameter) else real_form(K)):
        limit = divergence_speed(sector, diameter)
        text = f"{speed:g} rad/s is too fast: spin softening has used up the stiffness against"
        raise ModelError(f"{text} {diameter} nodal diameters at {limit:.6g} rad/s.")


def spinning(sector: CyclicSector, speed: float) -> csr_matrix:
    """(n, n) stiffness at an angular speed [rad/s] of a sector with matrices of rotation."""
    if speed == 0.0:
        return sector.K
    if sector.centrifugal is None:
        raise ConfigError("the sector has no matrices of rotation; see rom.rotating_sector.")
    return sector.K + speed**2 * sector.centrifugal


def real_form(T: csr_matrix) -> csr_matrix:
    """[[A, -B], [B, A]] of A + i B."""
    return csr_matrix(bmat([[T.real, -T.imag], [T.imag, T.real]]))


def _stacked(Z: Complex) -> Array:
    return np.vstack([Z.real, Z.imag])


def real_span(R: Complex) -> Array:
    """Real independent columns with the span of the real and imaginary parts."""
    U, s, _ = np.linalg.svd(np.hstack([R.real, R.imag]), full_matrices=False)
    return U[:, s > 1e-9 * s.max(initial=0.0)] if s.size else R.real


def _real(
    workers: Workers, K: csr_matrix, M: csr_matrix, rigid: Array, m: int, *, held: bool
) -> tuple[Array, Array]:
    """Lowest modes of a real symmetric system, held or with known motions without stiffness."""
    K, M = (0.5 * (A + A.T) for A in (K, M))
    m = min(m, K.shape[0])
    ops = workers.operators(K, M, None if held else rigid)
    return ops.modes(ops.hold([]) if held else [], m, finished=True)


def _waves(
    T: csr_matrix, K: csr_matrix, M: csr_matrix, pairs: Array, n_rigid: int, n: int
) -> tuple[Array, Complex]:
    """The n lowest complex shapes: of a pair, one is i times the other."""
    half = pairs.shape[0] // 2
    Z = pairs[:half] + 1j * pairs[half:]
    rigid, elastic = _basis(T, M, Z[:, :n_rigid]), _basis(T, M, Z[:, n_rigid:])
    KZ, MZ = K @ (T @ elastic), M @ (T @ elastic)
    H = (T @ elastic).conj().T
    lam, V = eigh(H @ KZ, H @ MZ)
    zero = np.zeros(rigid.shape[1])
    omega = np.concatenate([zero, np.sqrt(np.maximum(lam, 0.0))])
    return omega[:n], np.hstack([rigid, elastic @ V])[:, :n]


def _basis(T: csr_matrix, M: csr_matrix, Z: Complex) -> Complex:
    """Half as many columns, M-orthonormal, with the complex span of M-orthonormal real pairs."""
    U = T @ Z
    weight, V = np.linalg.eigh(U.conj().T @ (M @ U))
    keep = slice(Z.shape[1] - Z.shape[1] // 2, None)
    return Z @ (V[:, keep] / np.sqrt(weight[keep]))
