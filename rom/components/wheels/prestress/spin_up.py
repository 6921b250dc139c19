"""Steady states of a solid between rest and a speed, and vibrations about them, full and reduced.

Displacements and reduced matrices are interpolated by polynomials in tau = s / (s + omega_1^2), s
the square of the speed and omega_1 the lowest frequency at rest: a thin blade that rotation
straightens has a pole near s = -omega_1^2, of which tau knows nothing.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_matrix

from rom.arguments import Count, Positive, typed, unit_vector
from rom.components.wheels.modes import CyclicModes, cyclic_modes
from rom.components.wheels.prestress.steady_rotation import SteadyRotation
from rom.components.wheels.prestress.thermal import Heat, finite_solid
from rom.components.wheels.reduced import Functions, ReducedSector, projected, reduce_sector
from rom.components.wheels.rotation import refuse_attachments, rotation_matrices
from rom.components.wheels.sector import NO_DOFS, CyclicSector, all_rows, workers_of
from rom.components.wheels.travelling import TravellingModes, travelling_modes
from rom.eigen.supports import Fixed, held_dofs
from rom.errors import ConfigError, ModelError, reached, warn
from rom.model import Array, FEModel, Report
from rom.rows import row

N_CHECKED = 3  # lowest modes by which a reduction is judged
MODE_COUNT_FACTOR = 2  # modes computed per mode asked for, to find those of the neighbouring state
FREQUENCY_RTOL = 1e-3  # error that is worth a warning


@typed
@dataclass(frozen=True)
class SpeedTable(ABC):
    """Speeds between which something is interpolated.

    Attributes:
        speeds: (k,) tabulated angular speeds [rad/s], ascending from zero.
        omega: lowest circular frequency at rest, which sets the scale [rad/s].
    """

    speeds: Array
    omega: float

    @property
    def top(self) -> float:
        """The highest speed [rad/s]."""
        return float(self.speeds[-1])

    def weights(self, speed: float) -> Array:
        """(k,) weights [1] of the tabulated states at a speed [rad/s].

        Raises:
            ConfigError: if the speed is above the highest.
        """
        if not abs(speed) <= self.top * (1 + 1e-12):
            text = f"{speed!r} rad/s is beyond the {self.top:g} rad/s of rom.spin_up"
            raise ConfigError(f"{text}; give it more.")
        return lagrange(straightened(self.speeds, self.omega), straightened(speed, self.omega))

    @abstractmethod
    def at(self, speed: float) -> CyclicSector:
        """The sector in its steady state at a speed [rad/s]; for vibrations at this speed."""

    def modes(self, n: int, *, speed: float, diameter: int = 0) -> CyclicModes:
        """Real modes about the steady state, Coriolis forces left out; see `rom.cyclic_modes`."""
        return cyclic_modes(self.at(speed), diameter, n, speed=speed)

    def waves(self, n: int, *, speed: float, diameter: int = 0) -> TravellingModes:
        """Complex modes about the steady state; see `rom.travelling_modes`.

        Raises:
            ConfigError: as `rom.travelling_modes`, or if the speed is above the highest.
        """
        return travelling_modes(self.at(speed), diameter, n, speed=speed)


@typed
@dataclass(frozen=True)
class ReducedSpinUp(SpeedTable):
    """Few coordinates that follow the steady state, `SpinUp.reduced`.

    Attributes:
        sectors: the reduced sector at each tabulated speed, in coordinates that correspond.
        error: relative error [1] of the lowest frequencies half-way between the two speeds in the
            middle, against the full model in its own steady state there.
    """

    sectors: tuple[ReducedSector, ...] = ()
    error: float = np.nan

    @cached_property
    def certificate(self) -> Report:
        """The sectors at rest and at the highest speed against the full ones, and the error."""
        rows = [
            replace(line, quantity=f"state at {self.speeds[k]:.5g} rad/s, {line.quantity}")
            for k in (0, -1)
            for line in self.sectors[k].certificate.rows
        ]
        what = f"between states: worst error of {N_CHECKED} frequencies"
        rows.append(row(what, self.error, FREQUENCY_RTOL))
        return Report("certificate of the spin-up", tuple(rows))

    def at(self, speed: float) -> ReducedSector:
        """The reduced sector at a speed [rad/s], interpolated.

        Raises:
            ConfigError: if the speed is above the highest.
        """
        states = list(zip(self.weights(speed), self.sectors, strict=True))
        names = ("K", "M", "coriolis", "centrifugal", "Psi")
        mean = {name: sum(w * getattr(sector, name) for w, sector in states) for name in names}
        return replace(self.sectors[0], **mean)


@typed
@dataclass(frozen=True)
class SpinUp(SpeedTable):
    """Steady states of a solid from rest to a speed, `rom.spin_up`.

    Attributes:
        steady: equations of the steady states.
        sector: stiffness without load, mass, Coriolis matrix and spin softening.
        displacements: (n, k) at the tabulated speeds [m].
    """

    steady: SteadyRotation
    sector: CyclicSector
    displacements: Array

    def displacement(self, speed: float) -> Array:
        """(n,) displacement of the steady state at a speed [m].

        Raises:
            ConfigError: if the speed is above the highest.
            ModelError: if no equilibrium is found.
        """
        square = speed**2
        near = self.displacements @ self.weights(speed)
        exact = np.flatnonzero(np.abs(self.speeds - abs(speed)) <= 1e-12 * self.top)
        if exact.size:
            return self.displacements[:, exact[0]]
        self.steady.load(square)
        a = self.steady.newton(self.steady.independent(near))
        if a is None:
            k = int(np.flatnonzero(self.speeds < abs(speed))[-1])
            start = self.steady.independent(self.displacements[:, k])
            a, reached = self.steady.follow(start, self.speeds[k] ** 2, square, self.steady.load)
            if reached < square:
                text = f"no stable state at {speed:.5g} rad/s, the last at {reached**0.5:.5g}."
                raise ModelError(text, solution=self.steady.T @ a)
        return self.steady.T @ a

    def at(self, speed: float) -> CyclicSector:
        """The sector in its own steady state at a speed [rad/s], for vibrations at this speed.

        Raises:
            ConfigError: if the speed is above the highest.
            ModelError: if no stable state is found there.
        """
        K_t = self.steady.solid.tangent(self.displacement(speed))
        return replace(self.sector, K=csr_matrix(self.sector.K + K_t - self.steady.K_cold))

    def reduced(self, n_modes: int, *, functions: Functions | None = None) -> ReducedSpinUp:
        """Reduced matrices as functions of the speed.

        At each tabulated speed the state has a basis of its own: with cyclic faces that of
        `rom.reduce_sector`, without them its modes. Modes of neighbouring states are turned to
        resemble each other, then mass, stiffness, softening and Coriolis matrix are interpolated.

        Args:
            n_modes: number of modes, inside the faces where there are some.
            functions: on the cyclic faces, see `rom.reduce_sector`.

        Source:
            Amsallem and Farhat, An online method for interpolating linear parametric reduced-order
            models, SIAM J. Sci. Comput. 33 (2011) 2169.
        """
        sectors: list[ReducedSector] = []
        for speed in self.speeds:
            state = self.at(speed)
            wide = n_modes * (MODE_COUNT_FACTOR if sectors else 1)
            Psi, q, omega = _basis(state, float(speed), wide, functions)
            if sectors:
                Phi = _resembling(Psi[:, 2 * q :], sectors[-1].Psi[:, 2 * q :], state.M)
                Psi = np.hstack([Psi[:, : 2 * q], Phi])
            sectors.append(projected(state, Psi, q, omega))
        small = ReducedSpinUp(self.speeds, self.omega, tuple(sectors))
        error = self._error(small)
        if error > FREQUENCY_RTOL:
            warn(
                f"reduced frequencies are off by {error:.1e}, judged by the lowest {N_CHECKED} "
                f"between {self.speeds.size} states: ask for more states or modes."
            )
        return replace(small, error=error)

    def _error(self, small: ReducedSpinUp) -> float:
        k = (self.speeds.size - 1) // 2
        speed = float(np.mean(self.speeds[k : k + 2]))
        n = min(N_CHECKED, small.sectors[0].free.size)
        try:
            few, all_ = (table.waves(n, speed=speed).omega for table in (small, self))
        except ModelError:  # interpolation has made a motion that grows
            return np.inf
        return float(np.abs(few / all_ - 1).max())


def straightened(speed: Array | float, omega: float) -> Array:
    """The variable s / (s + omega^2) of the interpolation, s = speed^2."""
    s = np.square(speed)
    return np.asarray(s / (s + omega**2))


def lagrange(nodes: Array, x: Array | float) -> Array:
    """(k,) values at x of the polynomials that are one at one of k nodes, zero at the others."""
    others = ~np.eye(nodes.size, dtype=bool)
    gaps = np.where(others, nodes[:, None] - nodes, 1.0)
    return np.where(others, (x - nodes) / gaps, 1.0).prod(axis=1)


def _basis(
    state: CyclicSector, speed: float, n_modes: int, functions: Functions | None
) -> tuple[Array, int, Array]:
    """Shapes of a state: of one face, of the other, modes; the size of a face, frequencies."""
    if state.slave.size:
        small = reduce_sector(state, n_modes=n_modes, functions=functions)
        return small.Psi.copy(), small.master.size, small.omega
    modes = cyclic_modes(state, 0, n_modes, speed=speed)
    return modes.shapes.real.copy(), 0, modes.omega


def _resembling(Phi: Array, other: Array, M: csr_matrix) -> Array:
    """Of M-orthonormal modes those that continue others, turned to lie next to them (Procrustes).

    Modes may change places with those left out, but not share shapes with them.
    """
    likeness = Phi.T @ (M @ other)
    kept = np.sort(linear_sum_assignment(-(likeness**2))[0])
    U, _, Vt = np.linalg.svd(likeness[kept])
    return Phi[:, kept] @ (U @ Vt)


@typed
def spin_up(
    sector: CyclicSector,
    model: FEModel,
    *,
    speed: Annotated[float, Positive("rad/s")],
    n_states: Annotated[int, Count(2)] = 9,
    heat: Heat | None = None,
) -> SpinUp:
    """Steady states up to a speed, at large displacement and with the load that follows it.

    Args:
        sector: made from the model by `rom.CyclicSector.from_model` or `rom.held_solid`, cold and
            without matrices of rotation.
        model: its finite elements; under mpirun all ranks call, and share elements and factors.
        speed: highest angular speed [rad/s].
        n_states: number of tabulated states, rest and the highest speed included;
            between them full models find their own state, reduced ones interpolate.
        heat: a change of temperature, applied at rest.

    Raises:
        ConfigError: if the model has no finite elements or carries attachments.
        ModelError: if the solid passes an instability on its way; the message says where, and
            ``error.solution`` holds the states below.

    Source:
        St. Venant-Kirchhoff solid with forces that follow, Newton's method along the speed:
        Wriggers, Nonlinear Finite Element Methods (2008); see docs/theory/rotating_solids.md.
    """
    refuse_attachments(model)
    steady = SteadyRotation(sector, finite_solid(model, heat))
    a = steady.at_rest
    if heat is not None:
        a, share = steady.follow(a, 0.0, 1.0, steady.solid.warm)
        if share < 1.0:
            text = f"no stable state beyond {heat.described(share)}"
            raise ModelError(f"{text}: it buckles, see rom.thermal_buckling.")
    coriolis = rotation_matrices(sector.M, sector.axis)[0]
    base = replace(sector, coriolis=coriolis, centrifugal=csr_matrix(-steady.softening))
    omega = cyclic_modes(sector, 0, min(3, sector.free.size)).omega
    lowest = float(omega[omega > 0][0])  # of a free wheel two motions come before
    tau = straightened(speed, lowest) * (1 - np.cos(np.pi * np.arange(n_states) / (n_states - 1)))
    squares = lowest**2 * tau / (2 - tau)
    found = [a]

    def table() -> SpinUp:
        speeds = np.sqrt(squares[: len(found)])
        return SpinUp(speeds, lowest, steady, base, steady.T @ np.array(found).T)

    with reached(table):
        for k in range(1, n_states):
            a, square = steady.follow(found[-1], squares[k - 1], squares[k], steady.load)
            if square < squares[k]:
                text = f"no stable steady state was found above {np.sqrt(square):.5g} rad/s"
                raise ModelError(f"{text}; ask for a lower speed, or hold the solid more firmly.")
            found.append(a)
    return table()


@typed
def held_solid(
    model: FEModel,
    *,
    fixed: Fixed,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    at: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> CyclicSector:
    """A solid that turns with its supports, as a sector without cyclic faces.

    Its modes are those with 0 nodal diameters; `rom.rotating_sector` gives it the centrifugal
    stress of the linear solid, `rom.spin_up` that at large displacement.

    Args:
        model: the solid; under mpirun all ranks call, and each gets all rows.
        fixed: names of the interfaces that are held.
        axis: (3,) direction of the axis of rotation [1].
        at: (3,) a point of it [m].

    Raises:
        ConfigError: if nothing is held.
        InterfaceError: if an interface is unknown.
        ResourceError: on all ranks, if the solid does not fit on each of them.
    """
    if not fixed:
        raise ConfigError("a solid that turns needs a support: name the interfaces in fixed=(...).")
    return CyclicSector(
        n_sectors=2,  # with 0 diameters any number does
        K=all_rows(model, model.K),
        M=all_rows(model, model.M),
        slave=NO_DOFS,
        master=NO_DOFS,
        coupling=csr_matrix((0, 0)),
        held=held_dofs(model.interfaces, fixed),
        points=model.points,
        axis=unit_vector("axis", axis),
        at=np.asarray(at, dtype=float),
        workers=workers_of(model),
    )
