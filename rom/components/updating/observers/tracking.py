"""A body in operation, followed by a few sensors: a Kalman filter with unknown forces.

Modal coordinates are driven by forces of unknown history, which are random walks. With them as
states, accelerations are rows of the state like displacements; so is whatever is wanted where
nothing is measured.

Source:
    Kalman, A new approach to linear filtering and prediction problems, J. Basic Eng. 82 (1960) 35;
    forces as states: Lourens et al., An augmented Kalman filter for force identification in
    structural dynamics, Mech. Syst. Signal Process. 27 (2012) 446.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, typed
from rom.arguments.quantities import NotNegative, Positive
from rom.assembly.assembly import Assembly
from rom.body.flexible import FlexibleBody
from rom.components.updating.family_model import Held, check_units
from rom.components.updating.measured import Channels
from rom.components.updating.observers.filter_steps import filtered
from rom.components.updating.observers.operation import (
    UNITS,
    Linear,
    Operation,
    Sensors,
    check_seen,
    discrete,
    operation,
)
from rom.errors import ConfigError, SolverError
from rom.model import Array

TIME_RTOL = 1e-6  # of steps that count as equal
SETTLED_RTOL = 1e-12  # change of variances from one doubling to the next
MAX_DOUBLINGS = 60  # of the steps behind a steady state; twenty are usual
Step = Annotated[float, Positive("s")]
Walk = Annotated[float, Positive("N/s^(1/2)")]
White = Annotated[float, NotNegative("m kg^(1/2)/s^(3/2)")]
First = Annotated[float, Positive("N")] | None


@dataclass(frozen=True, slots=True)
class Track:
    """What a filter says about a record.

    Attributes:
        values: (n_t, n_v) what is wanted, by the samples up to then [m, m/s, m/s^2 or Pa].
        deviations: (n_t, n_v) their standard deviations [m, m/s, m/s^2 or Pa].
        forces: (n_t, n_e) estimated forces [N].
        force_deviations: (n_t, n_e) their standard deviations [N].
        surprise: (n_t,) squared innovations over their covariance: chi-square with as many
            degrees of freedom as there are samples at that time [1].
        covariance: (N, N) of the state after the last sample, logarithms of factors last.
        factors: (n_t, n_p) of parameters [1].
        factor_deviations: (n_t, n_p) their relative standard deviations [1].
    """

    values: Array
    deviations: Array
    forces: Array
    force_deviations: Array
    surprise: Array
    covariance: Array
    factors: Array
    factor_deviations: Array


@dataclass(frozen=True, slots=True)
class Observer:
    """The filter in its steady state: one gain for all times.

    x <- A (x + G (y - C x)); the values are W x, at the time of the next sample.

    Attributes:
        dt: step [s].
        A: (n, n) transition [1].
        G: (n, n_y) gain [unit of a state / unit of a sensor].
        C: (n_y, n) what sensors see [unit of a sensor / unit of a state].
        W: (n_v, n) what is wanted, forces first [unit of a value / unit of a state].
        deviations: (n_v,) standard deviations of these one step ahead [unit of a value].
        inputs: (n_y,) name and unit of each sensor.
        outputs: (n_v,) likewise of what is wanted.
    """

    dt: float
    A: Array
    G: Array
    C: Array
    W: Array
    deviations: Array
    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]

    def run(self, samples: npt.ArrayLike) -> Array:
        """(n_t, n_v) values [m, m/s, m/s^2 or Pa] a step after samples (n_t, n_y), from rest.

        Raises:
            ConfigError: for another number of sensors, or samples that are not finite.
        """
        y = finite("samples", samples, (None, len(self.C)))
        closed, driven = self.A - self.A @ self.G @ self.C, self.A @ self.G
        x, out = np.zeros(len(self.A)), np.zeros((len(y), len(self.W)))
        for k, pushed in enumerate(y @ driven.T):
            x = closed @ x + pushed
            out[k] = self.W @ x
        return out


@dataclass(frozen=True, slots=True)
class Tracker:
    """A body, its sensors, and what is wanted, sampled at equal steps.

    State: displacements s y and velocities y' of the modes, s the larger of frequency and
    one, then forces.

    Attributes:
        dt: step [s].
        A: (n, n) transition over a step [1].
        Q: (n, n) covariance of what a step adds [units of two states].
        C: (n_y, n) what sensors see [unit of a sensor / unit of a state].
        R: (n_y,) variances of samples [unit of a sensor, squared].
        W: (n_v, n) what is wanted [unit of a value / unit of a state].
        P: (n, n) covariance before the first sample [units of two states].
        n_forces: number of unknown forces.
        inputs: (n_y,) name and unit of each sensor.
        outputs: (n_v,) likewise of what is wanted.
    """

    dt: float
    A: Array
    Q: Array
    C: Array
    R: Array
    W: Array
    P: Array
    n_forces: int
    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]

    def run(self, samples: npt.ArrayLike, times: npt.ArrayLike | None = None) -> Track:
        """Filter a record that begins at rest.

        Args:
            samples: (n_t, n_y) in the order of the sensors [m/s^2 or 1]; NaN where one is missing.
            times: (n_t,) of the samples, to see that their steps are dt [s]; None to trust.

        Raises:
            ConfigError: for another number of sensors, infinite samples, or unequal steps.
        """
        y = checked_record(samples, times, len(self.C), self.dt)
        none = [np.zeros((0, *A.shape)) for A in (self.A, self.C, self.W)]
        at = Linear(self.A, none[0], self.C, none[1], self.W, none[2])
        return recorded(y, self.P, self.R, self.n_forces, 0, lambda x: (x, at, self.Q))

    def observer(self) -> Observer:
        """The filter in its steady state.

        Raises:
            SolverError: if there is none that can be computed.
        """
        P = steady(self.A, self.C, self.Q, self.R)
        G = P @ self.C.T @ np.linalg.inv(self.C @ P @ self.C.T + np.diag(self.R))
        W = np.vstack([np.eye(len(P))[len(P) - self.n_forces :], self.W])
        forces = tuple((f"force[{k}]", "N") for k in range(1, self.n_forces + 1))
        deviations = np.sqrt(np.maximum(np.einsum("ij,ij->i", W @ P, W), 0.0))
        return Observer(
            self.dt, self.A, G, self.C, W, deviations, self.inputs, forces + self.outputs
        )


def steady(A: Array, C: Array, Q: Array, R: Array) -> Array:
    """(n, n) covariance before a sample, after infinitely many: the discrete Riccati equation.

    Arguments are as of `Tracker`.

    Source:
        Doubling: Anderson, Second-order convergent algorithms for the steady-state Riccati
        equation, Int. J. Control 28 (1978) 295.
    """
    F, G, P = A.T, C.T @ (C / R[:, None]), Q
    for _ in range(MAX_DOUBLINGS):
        with np.errstate(over="ignore", invalid="ignore"):
            W = np.linalg.inv(np.eye(len(A)) + G @ P)
            new = P + F.T @ P @ W @ F
            G = G + F @ W @ G @ F.T
            F = F @ W @ F
        new, old = 0.5 * (new + new.T), np.diag(P)
        P = new
        if not np.isfinite(P).all():
            break
        if (np.abs(np.diag(P) - old) <= SETTLED_RTOL * np.diag(P)).all():
            return P
    text = "the filter has no steady state that can be computed."
    hint = "Give noise that fits the sensors, or leave out modes far above the samples."
    raise SolverError(text, hint=hint)


Points = Callable[[Array], tuple[Array, Linear, Array]]


def recorded(
    y: Array, P: Array, R: Array, n_forces: int, n_p: int, points: Points, reach: float = np.inf
) -> Track:
    """Filter samples y (n_t, n_y), NaN where one is missing, of a record that begins at rest.

    P (N, N) is the covariance before the first one, with forces and parameters as the last states;
    R (n_y,) are variances of samples. Points give, of logarithms of factors (n_p,), the point about
    which to linearise, the equations there, A being the transition, and the covariance (N, N) of
    what a step adds; beyond the reach of a logarithm from it another point is taken.
    """
    N, n = len(P), len(P) - n_p
    z, P, k = np.zeros(N), P.copy(), 0
    scratch = np.zeros((N, N)), np.zeros((N, N)), np.zeros(N), np.zeros(N)
    forces = np.eye(n)[n - n_forces :]
    point, at, Q = points(z[n:])
    n_v = len(at.W)
    values, variances = np.zeros((2, len(y), n_v + n_forces + n_p))
    out = values, variances, np.zeros(len(y))
    while True:
        W = np.vstack([at.W, forces])
        dW = np.concatenate([at.dW, np.zeros((n_p, n_forces, n))], axis=1)
        model = (point, at.A, at.dA, Q, at.C, at.dC, W, dW)
        k = filtered(k, y, z, P, tuple(map(np.ascontiguousarray, model)), R, reach, scratch, out)
        if k == len(y):
            break
        point, at, Q = points(z[n:])
    cuts = [n_v, n_v + n_forces]
    wanted, pushed, x = np.split(values, cuts, axis=1)
    by_wanted, by_force, by_factor = np.split(np.sqrt(np.maximum(variances, 0.0)), cuts, axis=1)
    return Track(wanted, by_wanted, pushed, by_force, out[2], P, np.exp(x), by_factor)


def checked_record(
    samples: npt.ArrayLike, times: npt.ArrayLike | None, n_y: int, dt: float
) -> Array:
    """(n_t, n_y) samples on equal steps."""
    y = np.ascontiguousarray(samples, dtype=float)
    if y.ndim != 2 or y.shape[1] != n_y or np.isinf(y).any():
        raise ConfigError(f"samples {y.shape} must be (n_t, {n_y}) numbers, or NaN.")
    if times is None:
        return y
    times = finite("times", times, (len(y),))
    steps = np.diff(times)
    for k in np.flatnonzero(np.abs(steps - dt) > TIME_RTOL * dt)[:1]:
        text = f"the step after t = {times[k]:.9g} s is {steps[k]:.6g} s; it must be {dt:.6g} s."
        hint = "Put the record on equal steps, with NaN where nothing was measured."
        raise ConfigError(text, hint=hint)
    return y


@dataclass(frozen=True, slots=True)
class Assumed:
    """What a filter assumes of its time steps and forces."""

    dt: float  # step between samples [s]
    walk: float  # standard deviation of a force after a second [N/s^(1/2)]
    unmodelled: float = 0.0  # intensity of white accelerations of each mode [m kg^(1/2)/s^(3/2)]
    first: float | None = None  # deviation of forces before the first sample [N]; None: of a second

    def white(self, operation: Operation) -> Array:
        """(n, n) intensity of the noise of the state."""
        m, n_e = operation.driven.shape
        sizes = np.repeat([0.0, self.unmodelled, self.walk], [m, m, n_e])
        return np.diag(sizes**2)

    def before(self, operation: Operation) -> Array:
        """(n, n) covariance of the state before the first sample: at rest, forces unknown."""
        m, n_e = operation.driven.shape
        first = self.walk if self.first is None else self.first
        return np.diag(np.repeat([0.0, first**2], [2 * m, n_e]))


def named_values(several: Sequence[Sensors]) -> tuple[tuple[str, str], ...]:
    """Name and unit of each channel."""
    return tuple((name, UNITS[s.quantity]) for s in several for name in s.names)


def linear_tracker(
    operation: Operation,
    x: Array,
    assumed: Assumed,
    sensors: Sequence[Sensors],
    wanted: Sequence[Sensors],
) -> Tracker:
    """The filter at logarithms x (n_p,) of factors, which stay."""
    at, n_e = operation.at(x), operation.driven.shape[1]
    if len(at.C) < n_e:
        text = f"{len(at.C)} sensors for {n_e} unknown forces."
        raise ConfigError(text, hint="Add sensors, or join forces that have one history.")
    R = np.concatenate([np.full(len(s.names), s.noise**2.0) for s in sensors])
    if not R.all():
        raise ConfigError("a sensor has no noise; give its standard deviation.")
    check_seen(at, operation)
    step, Q = discrete(at.A, assumed.white(operation), assumed.dt)
    P, names = assumed.before(operation), (named_values(sensors), named_values(wanted))
    return Tracker(assumed.dt, step, Q, at.C, R, at.W, P, n_e, *names)


@typed
def tracker(  # noqa: PLR0913  keywords of one call
    body: FlexibleBody | Assembly,
    sensors: Sequence[Sensors],
    forces: Channels,
    wanted: Sequence[Sensors],
    *,
    dt: Step,
    walk: Walk,
    fixed: Held = (),
    unmodelled: White = 0.0,
    first: First = None,
) -> Tracker:
    """A filter that estimates forces, and motion and stress anywhere, from a few sensors.

    Args:
        body: with its outer surface, damped, in SI units; or several, as an assembly.
        sensors: what is measured, with its noise.
        forces: where unknown forces act.
        wanted: what is to be estimated.
        dt: step between samples [s].
        walk: standard deviation of a force after a second, as a random walk [N/s^(1/2)].
        fixed: what is held, see `FlexibleBody.frequencies`.
        unmodelled: intensity of white accelerations of each mode, for what the model
            does not know [m kg^(1/2)/s^(3/2)].
        first: standard deviation of the forces before the first sample [N]; None for a second of
            their walk. The body is at rest then.

    Raises:
        ConfigError: for channels off the body, fewer sensors than forces, sensors without noise,
            numbers that are not positive, or a body in other units.
        ModelError: if the body has no surface or stress where they are needed, or if sensors do
            not see a force or a motion that lasts, which is named.
    """
    check_units(body)
    assumed = Assumed(dt, walk, unmodelled, first)
    motion = operation(body, (), {}, (sensors, forces, wanted), None, fixed)
    return linear_tracker(motion, np.zeros(0), assumed, sensors, wanted)
