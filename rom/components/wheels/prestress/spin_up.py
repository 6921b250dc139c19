"""From a model to its steady states in rotation."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from rom.arguments import positive, typed, unit_vector, whole
from rom.components.wheels.modes import cyclic_modes
from rom.components.wheels.prestress.heat import Heat
from rom.components.wheels.prestress.speed_table import SpinUp, straightened
from rom.components.wheels.prestress.steady_rotation import SteadyRotation
from rom.components.wheels.prestress.thermal import finite_solid
from rom.components.wheels.rotation import rotation_matrices
from rom.components.wheels.sector import NO_DOFS, CyclicSector, all_rows, workers_of
from rom.eigen.supports import Fixed, held_dofs
from rom.errors import ConfigError, ModelError, reached
from rom.model import Array, FEModel


@typed
def spin_up(
    sector: CyclicSector,
    model: FEModel,
    *,
    speed: float,
    n_states: int = 9,
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
        ConfigError: if the model has no finite elements or carries attachments, or for a wrong
            speed or number of states.
        ModelError: if the solid passes an instability on its way; the message says where, and
            ``error.solution`` holds the states below.

    Source:
        St. Venant-Kirchhoff solid with forces that follow, Newton's method along the speed:
        Wriggers, Nonlinear Finite Element Methods (2008); see docs/theory/rotating_solids.md.
    """
    positive("speed", speed)
    whole("n_states", n_states, 2, reason="rest and the top")
    if model.attachments:
        raise ConfigError(
            f"the model carries {len(model.attachments)} attachments, whose rotation is not known.",
            hint="Mesh them as a region of their own density.",
        )
    steady = SteadyRotation(sector, finite_solid(model, heat))
    a = steady.at_rest if heat is None else _warmed(steady, heat)
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
            found.append(_next(steady, found[-1], squares[k - 1], squares[k]))
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


def _warmed(steady: SteadyRotation, heat: Heat) -> Array:
    a, share = steady.follow(steady.at_rest, 0.0, 1.0, steady.solid.warm)
    if share < 1.0:
        raise ModelError(
            f"no stable state beyond {heat.described(share)}: the solid buckles.",
            hint="rom.thermal_buckling tells where that of the linear solid does.",
        )
    return a


def _next(steady: SteadyRotation, a: Array, start: float, end: float) -> Array:
    a, square = steady.follow(a, start, end, steady.load)
    if square < end:
        raise ModelError(
            f"no stable steady state was found above {np.sqrt(square):.5g} rad/s: rotation has "
            "used up the stiffness there.",
            hint="Ask for a lower speed, or hold the solid more firmly.",
        )
    return a
