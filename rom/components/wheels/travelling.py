"""Waves that travel around a rotating wheel, with Coriolis forces.

Over the speed they are followed by their shapes and not by their order.
"""

from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.linalg import eig
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import LinearOperator, eigs, splu

from rom.arguments import not_negative, typed, vector, whole
from rom.components.wheels.modes import cyclic_modes, real_form, spinning
from rom.components.wheels.sector import Complex, CyclicSector
from rom.eigen.scipy import negative_count
from rom.eigen.verbs import count_shift
from rom.errors import ConfigError, ModelError, ModesMissedError
from rom.model import Array, Modes
from rom.process.spreading import spread

GROWTH_RATE_RTOL = 1e-4  # growth rate of an unstable motion, of the largest frequency found
RIGID_RTOL = 0.01  # of the speed: distance of a rigid motion's frequency from zero or the speed
N_SPARE_WAVES = 4  # beyond those asked for, or followed: waves from above may cross them
MAX_DENSE_DOFS = 40  # all waves are computed at once up to here


class Waves:
    """Frequencies of waves that run ahead with the rotation, or back against it."""

    omega: Array
    direction: Array

    @property
    def frequencies(self) -> Array:
        """(..., m) frequencies seen from the wheel [Hz]."""
        return self.omega / (2 * np.pi)

    @property
    def forward(self) -> Array:
        """(..., k) those of the waves that run ahead [Hz]."""
        return self.frequencies[..., self.direction > 0]

    @property
    def backward(self) -> Array:
        """(..., k) those of the waves that run back [Hz]."""
        return self.frequencies[..., self.direction < 0]


@typed
@dataclass(frozen=True, kw_only=True)
class TravellingModes(Waves, Modes):
    """Waves with the same number of nodal diameters on a wheel that turns steadily.

    Seen from the wheel; an observer at rest sees ``frequencies`` changed by the turning pattern,
    see `at_rest`.

    Attributes:
        omega: (m,) circular frequencies seen from the wheel [rad/s], ascending.
        shapes: (n, m) complex displacements of sector 0 at the time 0, u_j = exp(i n j alpha) u_0;
            they turn with exp(-i omega t) in forward and exp(i omega t) in all other waves.
        sector: the sector.
        diameter: number n of nodal diameters.
        speed: angular speed Omega [rad/s].
        direction: (m,) [1] +1 for waves that run ahead with the rotation, -1 against it, 0 where a
            wave stands: n = 0 and N / 2.
    """

    sector: CyclicSector
    diameter: int
    speed: float
    direction: Array

    @property
    def at_rest(self) -> Array:
        """(m,) frequencies seen by an observer at rest [Hz]: f + n Omega, or f - n Omega.

        A negative one runs ahead more slowly than the wheel turns: it moves forward in space.
        """
        turns = self.diameter * self.speed / (2 * np.pi)
        return self.frequencies + turns * self.direction


@typed
def travelling_modes(
    sector: CyclicSector, diameter: int, n: int, *, speed: float
) -> TravellingModes:
    """Lowest waves of a rotating wheel, forward and backward, with Coriolis forces.

    Args:
        sector: with matrices of rotation, see `rom.rotating_sector`; full or reduced.
        diameter: number of nodal diameters, 0 to N / 2.
        n: number of waves, counting both directions.
        speed: angular speed [rad/s], not zero; its sign is that of the axis.

    Raises:
        ConfigError: if the wheel cannot have the diameters, or has no matrices of rotation.
        ModelError: if a motion grows: the speed is above that of an instability.
        ModesMissedError: if the inertia count of a supported wheel says that a wave was skipped.

    Source:
        Bryan, On the beats in the vibrations of a revolving cylinder or bell, Proc. Cambridge
        Phil. Soc. 7 (1890) 101; see docs/theory/rotating_solids.md.
    """
    K = spinning(sector, speed)
    T = sector.harmonic(sector.checked(diameter))
    if speed == 0.0:
        raise ConfigError("speed = 0 has waves that stand: at rest use cyclic_modes.")
    standing = sector.standing(diameter)
    n = whole("n", n, 1, T.shape[1] if standing else 2 * T.shape[1])
    wanted = 2 * n if standing else n
    H = T.conj().T
    M, G, K = (csr_matrix(H @ A @ T) for A in (sector.M, speed * sector.coriolis, K))
    lam, U = _lowest(M, G, K, wanted, 0.0 if sector.supported else 0.3 * abs(speed))
    _refuse_growth(lam if sector.supported else _elastic(lam, speed), diameter, speed)
    if sector.supported and lam.size > wanted:
        _verify(M, G, K, lam, U, wanted)
    keep = np.arange(wanted) if not standing else np.flatnonzero(lam.imag > 0)[:n]
    lam, U = lam[keep], U[:, keep]
    ahead = np.zeros(lam.size) if standing else -np.sign(lam.imag) * np.sign(speed)
    shapes = T @ (U / np.sqrt(np.einsum("fm,fm->m", U.conj(), M @ U).real))
    return TravellingModes(
        abs(lam.imag), shapes, sector=sector, diameter=diameter, speed=abs(speed), direction=ahead
    )


def _lowest(
    M: csr_matrix, G: csr_matrix, K: csr_matrix, m: int, shift: float
) -> tuple[Complex, Complex]:
    """Eigenvalues of lam^2 M + lam G + K nearest to the shift, and some more, by size.

    With lam = shift + mu, 1 / mu is an eigenvalue of the inverse of the companion matrix, which
    costs one solution with K + shift G + shift^2 M.
    """
    f, k = K.shape[0], m + N_SPARE_WAVES
    D = csr_matrix(G + 2 * shift * M)
    try:
        solve = splu(csc_matrix(K + shift * G + shift**2 * M, dtype=complex)).solve
    except RuntimeError as error:
        text = "rotation has used up the stiffness of the wheel: stay below divergence_speed."
        raise ModelError(text) from error

    def inverse(y: Complex) -> Complex:
        a, b = y[:f].ravel(), y[f:].ravel()
        return np.concatenate([-solve(M @ b + D @ a), a])

    if f <= MAX_DENSE_DOFS or k >= 2 * f - 1:
        columns = [inverse(e) for e in np.eye(2 * f, dtype=complex)]
        mu, V = eig(np.array(columns).T)
    else:
        operator = LinearOperator((2 * f, 2 * f), matvec=inverse, dtype=complex)
        start = np.exp(1j * np.arange(2 * f))
        mu, V = eigs(operator, k, v0=start, tol=0.0, ncv=max(2 * k + 1, 20))
    lam = shift + 1 / mu
    order = np.argsort(abs(lam))
    return lam[order], V[:f, order]


def _elastic(lam: Complex, speed: float) -> Complex:
    """Without motions of a free wheel as a whole: double roots, of which round-off makes growth.

    Whoever floats along in a straight line is seen from the wheel to circle at its speed.
    """
    rigid = np.minimum(abs(lam), abs(abs(lam) - abs(speed))) < RIGID_RTOL * abs(speed)
    return lam[~rigid]


def _refuse_growth(lam: Complex, diameter: int, speed: float) -> None:
    growth = lam.real.max(initial=0.0)
    if growth > GROWTH_RATE_RTOL * abs(lam).max(initial=0.0):
        worst = lam[lam.real.argmax()]
        text = f"at {speed:g} rad/s one with {diameter} nodal diameters grows by {growth:.3g} 1/s"
        where = f"at {abs(worst.imag) / (2 * np.pi):.4g} Hz"
        raise ModelError(f"{text} {where}, an instability; see divergence_speed.")


def _verify(M: csr_matrix, G: csr_matrix, K: csr_matrix, lam: Complex, U: Complex, m: int) -> None:
    """Waves below a frequency: the inertia of L(w) = K - w^2 M + i w G, for both directions.

    An eigenvalue of L falls through zero at each wave; it rises through zero where a wave that the
    rotation carries along seems to run back, as all do that are slower than the wheel turns. The
    softening has then made K indefinite, and the count begins there.
    """
    count, square = count_shift(abs(lam) ** 2, m)
    w = np.sqrt(square)
    start = negative_count(csc_matrix(real_form(K))) // 2
    U, lam = U[:, :count], lam[:count]
    inertia = np.einsum("fm,fm->m", U.conj(), M @ U).real
    coriolis = np.einsum("fm,fm->m", U.conj(), G @ U).imag
    for sign in (1, -1):
        here = np.sign(lam.imag) == sign
        falls = np.sign(2 * abs(lam.imag) * inertia + sign * coriolis)[here]
        A = csr_matrix(K - square * M + 1j * sign * w * G)
        true = negative_count(csc_matrix(real_form(A))) // 2
        if true != start + falls.sum():
            waves = f"{falls.size} waves below {w / (2 * np.pi):.6g} Hz"
            text = f"the inertia of the system, {true} from {start} on, does not agree with {waves}"
            raise ModesMissedError(f"{text}; ask for more.")


SPEEDS_AT_ONCE = 8  # whose waves are kept until they are followed


@typed
@dataclass(frozen=True)
class WheelCampbell(Waves):
    """Frequencies over the speed, each column one wave.

    Attributes:
        speeds: (s,) [rad/s].
        diameter: number of nodal diameters.
        omega: (s, n) circular frequencies seen from the wheel [rad/s]; a column may cross others.
        direction: (n,) [1] as of `TravellingModes`.
        mac: (s, n) likeness [1], 0 to 1, of each shape to that at the speed before; where it is
            near one half two waves change their shapes, and the speeds are too far apart.
    """

    speeds: Array
    diameter: int
    omega: Array
    direction: Array
    mac: Array


@typed
def wheel_campbell(
    sector: CyclicSector,
    diameter: int,
    n: int,
    *,
    speeds: npt.ArrayLike,
    executor: Executor | None = None,
) -> WheelCampbell:
    """Follow the lowest waves of the first speed through all others by their shapes.

    From speed to speed each wave takes the one of its direction that is most like it, no two the
    same: the modal assurance criterion |a^H M b|^2 of mass-normalised shapes, summed over all, is
    the largest there is. Under mpirun the ranks share the speeds, and all must call.

    Args:
        sector: with matrices of rotation, see `rom.rotating_sector`; full or reduced.
        diameter: number of nodal diameters.
        n: number of waves, counting both directions.
        speeds: (s,) angular speeds [rad/s], not negative; the first may be zero.
        executor: of `concurrent.futures`, whose workers share the speeds; None for none.

    Raises:
        ConfigError: if a speed is negative, or the wheel has not so many waves.
        ModelError, ModesMissedError: see `rom.travelling_modes`.

    Source:
        Campbell, The protection of steam-turbine disk wheels from axial vibration, Trans. ASME
        46 (1924) 31; see docs/theory/rotating_solids.md.
    """
    Omega = vector("speeds", speeds)
    not_negative("speeds", Omega.min())
    omega, direction, shapes = _waves(sector, diameter, n, Omega[0])
    omega, direction, shapes = omega[:n], direction[:n], shapes[:, :n]
    found, likeness = [omega], [np.ones(n)]
    for w, sides, U in _followed(sector, diameter, n, Omega[1:], executor):
        mac = np.abs(shapes.conj().T @ (sector.M @ U)) ** 2
        mac[direction[:, None] != sides] = -1.0
        kept = linear_sum_assignment(-mac)[1]
        found.append(w[kept])
        likeness.append(mac[np.arange(n), kept])
        shapes = U[:, kept]
    return WheelCampbell(Omega, diameter, np.array(found), direction, np.array(likeness))


def _followed(
    sector: CyclicSector, diameter: int, n: int, speeds: Array, executor: Executor | None
) -> Iterator[tuple[Array, Array, Complex]]:
    """The waves at one speed after the other; ranks share a few speeds at a time."""
    for first in range(0, speeds.size, SPEEDS_AT_ONCE):
        some = speeds[first : first + SPEEDS_AT_ONCE].tolist()
        at = partial(_waves, sector, diameter, n)
        if executor is not None:
            yield from spread(at, some, executor)
        else:
            yield from sector.workers.each(at, some, [1.0] * len(some))


def _waves(
    sector: CyclicSector, diameter: int, n: int, speed: float
) -> tuple[Array, Array, Complex]:
    """Circular frequencies, directions and mass-normalised shapes of n waves and a few more."""
    standing, free = sector.standing(diameter), sector.free.size
    most = free if standing else 2 * free
    n = whole("n", n, 1, most)
    if speed:
        waves = travelling_modes(sector, diameter, min(n + N_SPARE_WAVES, most), speed=speed)
        return waves.omega, waves.direction, waves.shapes
    if standing:
        modes = cyclic_modes(sector, diameter, min(n + N_SPARE_WAVES, free))
        return modes.omega, np.zeros(modes.omega.size), modes.shapes
    modes = cyclic_modes(sector, diameter, min((n + 1) // 2 + N_SPARE_WAVES, free))
    both = np.tile([1.0, -1.0], modes.omega.size)  # at rest a wave runs either way
    return np.repeat(modes.omega, 2), both, np.repeat(modes.shapes, 2, axis=1)
