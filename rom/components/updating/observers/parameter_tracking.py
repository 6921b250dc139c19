"""Parameters of a body that change slowly in operation, estimated with its motion and forces.

Logarithms of factors are random walks beside the forces. The transition over a step is exact at
one point of the parameters and linear in their distance from it; when they have moved away, the
point moves after them.

Source:
    Extended filter: Jazwinski, Stochastic processes and filtering theory (1970), chapter 8;
    parameters as states: Hoshiya and Saito, Structural identification by extended Kalman filter,
    J. Eng. Mech. 110 (1984) 1757.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from rom.arguments import positive, typed
from rom.arguments.quantities import NotNegative, Positive
from rom.components.updating.family_model import Attached, Family, Held, check_units
from rom.components.updating.measured import Channels
from rom.components.updating.observers import operation, tracking
from rom.components.updating.observers.operation import Linear, Operation, Sensors
from rom.components.updating.observers.tracking import Track, Tracker
from rom.errors import ConfigError, ParameterError, SolverError
from rom.model import Array
from rom.names import check_known
from rom.plausible import check_damping_ratio

LINEAR_REACH = 5e-3  # of a logarithm, within which transitions are linear in it


@typed
@dataclass(frozen=True, slots=True)
class Drift:
    """How a factor may change.

    Attributes:
        first: its relative standard deviation about one before the first sample [1].
        walk: relative standard deviation after a second, as a random walk [1/s^(1/2)].
    """

    first: Annotated[float, Positive()]
    walk: Annotated[float, NotNegative()] = 0.0


@dataclass(frozen=True, slots=True)
class ParameterTracker:
    """A family with sensors and unknown forces, and parameters that change.

    Attributes:
        R: (n_y,) variances of samples [unit of a sensor, squared].
    """

    operation: Operation
    assumed: tracking.Assumed
    drifts: Mapping[str, Drift]
    R: Array
    sensors: tuple[Sensors, ...]
    wanted: tuple[Sensors, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return self.operation.model.names

    def run(self, samples: npt.ArrayLike, times: npt.ArrayLike | None = None) -> Track:
        """Filter a record that begins at rest.

        Samples and times are as of `Tracker.run`.

        Raises:
            ConfigError: for another number of sensors, infinite samples, or unequal steps.
            SolverError: if a parameter leaves the range of its family.
        """
        y = tracking.checked_record(samples, times, len(self.R), self.assumed.dt)
        first = np.array([d.first for d in self.drifts.values()])
        P = block_diag(self.assumed.before(self.operation), np.diag(first**2))
        n_e = self.operation.driven.shape[1]
        return tracking.recorded(y, P, self.R, n_e, first.size, self.at, LINEAR_REACH)

    def at(self, x: Array) -> tuple[Array, Linear, Array]:
        """The point x (n_p,) [1], steps of the equations there, and noise (N, N) [of two states].

        Raises:
            SolverError: if a parameter has left its range.
        """
        o, dt, ends = self.operation, self.assumed.dt, self.operation.model.ends
        for j in np.flatnonzero(~((ends[0] <= x) & (x <= ends[1])))[:1]:
            here, low, high = (f"{np.exp(y[j]):.4g}" for y in (x, *ends))
            raise SolverError(
                f"parameter {self.names[j]!r} has reached the factor {here}; the family goes from "
                f"{low} to {high}.",
                hint="See whether forces, noise and support are those of the body, then make a "
                "family with a wider range.",
            )
        rates = o.at(x)
        step, Q = operation.discrete(rates.A, self.assumed.white(o), dt)
        walks = np.array([d.walk for d in self.drifts.values()])
        at = replace(rates, A=step, dA=operation.step_derivatives(rates.A, rates.dA, dt))
        return x.copy(), at, block_diag(Q, np.diag(walks**2 * dt))

    def held(self, **factors: float) -> Tracker:
        """The filter with factors that stay, for its steady state and its FMU.

        Args:
            factors: by name; one for those not given [1].

        Raises:
            ParameterError: for a name that is not tracked, or a factor that is not positive.
        """
        for name in factors:
            check_known(name, self.names, f"{name!r} must be one of", ParameterError)
        x = np.log([positive(name, factors.get(name, 1.0)) for name in self.names])
        return tracking.linear_tracker(self.operation, x, self.assumed, self.sensors, self.wanted)


@typed
def parameter_tracker(  # noqa: PLR0913  keywords of one call
    family: Family,
    sensors: Sequence[Sensors],
    forces: Channels,
    wanted: Sequence[Sensors],
    *,
    parameters: Mapping[str, Drift],
    dt: tracking.Step,
    walk: tracking.Walk,
    damping: float = 0.01,
    attached: Attached | None = None,
    fixed: Held = (),
    unmodelled: tracking.White = 0.0,
    first: tracking.First = None,
) -> ParameterTracker:
    """A filter that also follows parameters: a joint that loosens, a mass that grows.

    Parameters are {name: `Drift`} of the family or of what is attached, {name: `GroundSpring`,
    `AddedMass` or `JointSpring`}; others stay at one. The family is as of `rom.update`, in SI
    units, the damping that of all modes at factors of one [1]. The rest is as of `tracker`.

    Raises:
        ConfigError: as `tracker`, or for an unknown parameter or none.
        ModelError: as `tracker`.
        ParameterError: for a name that is taken.
        InterfaceError: if an interface is unknown.
    """
    check_units(family)
    if not parameters:
        raise ConfigError("no parameter changes.", hint="Use tracker for a body that stays.")
    check_damping_ratio(damping)
    channels, names = (sensors, forces, wanted), tuple(parameters)
    motion = operation.operation(family, names, dict(attached or {}), channels, damping, fixed)
    assumed = tracking.Assumed(dt, walk, unmodelled, first)
    R = tracking.linear_tracker(motion, np.zeros(len(names)), assumed, sensors, wanted).R
    return ParameterTracker(motion, assumed, dict(parameters), R, tuple(sensors), tuple(wanted))
