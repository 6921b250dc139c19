"""A body in operation, followed by a few sensors: a Kalman filter with unknown forces.

Modal coordinates are driven by forces of unknown history, which are random walks. With them as
states, accelerations are rows of the state like displacements; so is whatever is wanted where
nothing is measured.

Source:
    Kalman, A new approach to linear filtering and prediction problems, J. Basic Eng. 82 (1960) 35;
    forces as states: Lourens et al., An augmented Kalman filter for force identification in
    structural dynamics, Mech. Syst. Signal Process. 27 (2012) 446; noise of a step: Van Loan,
    Computing integrals involving the matrix exponential, IEEE Trans. Autom. Control 23 (1978) 395.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from rom.arguments import finite, one_of, positive, typed
from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array
from rom.names import named
from rom.updating.measured import POINT_RTOL, Channels

UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "stress": "Pa"}
UNSEEN_STATE_RTOL = 1e-9  # singular value of a motion that no sensor sees, over the largest
DAMPED_RTOL = 1e-9  # decay over frequency from which on an unseen motion dies out by itself
TIME_RTOL = 1e-6  # of steps that count as equal
SETTLED_RTOL = 1e-12  # change of variances from one doubling to the next
MAX_DOUBLINGS = 60  # of the steps behind a steady state; twenty are usual
MAX_NORM = 0.5  # of a matrix whose exponential is summed; longer steps are doublings


@dataclass(frozen=True, slots=True)
class Sensors:
    """Channels of one kind, measured or wanted.

    Attributes:
        channels: where, and along which direction.
        quantity: "displacement", "velocity", "acceleration", or "stress", which is the normal
            stress along the direction.
        noise: standard deviation of a sample [unit of the quantity]; not used where it is wanted.

    Raises:
        ConfigError: for another quantity, or noise that is negative or not finite.
    """

    channels: Channels
    quantity: str
    noise: float = 0.0

    def __post_init__(self) -> None:
        one_of("quantity", self.quantity, tuple(UNITS))
        if finite("noise", self.noise, ()) < 0:
            raise ConfigError(f"noise = {self.noise} is negative.")

    @property
    def names(self) -> tuple[str, ...]:
        """Quantity and number from one of each channel."""
        n = len(np.asarray(self.channels.points))
        return tuple(f"{self.quantity}[{k}]" for k in range(1, n + 1))


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
        covariance: (n, n) of the state after the last sample.
    """

    values: Array
    deviations: Array
    forces: Array
    force_deviations: Array
    surprise: Array
    covariance: Array


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

    def run(self, samples: Any) -> Array:
        """(n_t, n_v) values [m, m/s, m/s^2 or Pa] a step after samples (n_t, n_y), from rest.

        Raises:
            ConfigError: for another number of sensors, or samples that are not finite.
        """
        y = finite("samples", samples, None)
        if y.ndim != 2 or y.shape[1] != len(self.C):
            raise ConfigError(f"samples {y.shape}: (n_t, {len(self.C)}) are taken.")
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

    def run(self, samples: Any, times: Any = None) -> Track:
        """Filter a record that begins at rest.

        Args:
            samples: (n_t, n_y), in the order of the sensors; NaN where one is missing.
            times: (n_t,) of the samples, to see that their steps are dt [s]; None to trust.

        Raises:
            ConfigError: for another number of sensors, infinite samples, or unequal steps.
        """
        y = np.asarray(samples, dtype=float)
        if y.ndim != 2 or y.shape[1] != len(self.C) or np.isinf(y).any():
            raise ConfigError(f"samples {y.shape}: (n_t, {len(self.C)}) numbers are taken, or NaN.")
        if times is not None:
            self._check_times(finite("times", times, (len(y),)))
        rows = np.vstack([self.W, np.eye(len(self.A))[len(self.A) - self.n_forces :]])
        x, P = np.zeros(len(self.A)), self.P.copy()
        values, variances = np.zeros((2, len(y), len(rows)))
        surprise = np.zeros(len(y))
        for k, sample in enumerate(y):
            if k:
                x, P = self.A @ x, self.A @ P @ self.A.T + self.Q
            for c, r, z in zip(self.C, self.R, sample, strict=True):
                if not np.isnan(z):
                    surprise[k] += _corrected(x, P, c, r, z)
            values[k] = rows @ x
            variances[k] = np.einsum("ij,ij->i", rows @ P, rows)
        deviations, n = np.sqrt(np.maximum(variances, 0.0)), len(self.W)
        return Track(
            values[:, :n], deviations[:, :n], values[:, n:], deviations[:, n:], surprise, P
        )

    def _check_times(self, times: Array) -> None:
        wrong = np.flatnonzero(np.abs(np.diff(times) - self.dt) > TIME_RTOL * self.dt)
        if wrong.size:
            k = int(wrong[0])
            raise ConfigError(
                f"the step after t = {times[k]:.9g} s is {times[k + 1] - times[k]:.6g} s, that of "
                f"the tracker {self.dt:.6g} s.",
                hint="Put the record on equal steps, with NaN where nothing was measured.",
            )

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

    Args:
        A: (n, n) transition.
        C: (n_y, n) what sensors see.
        Q: (n, n) covariance of what a step adds.
        R: (n_y,) variances of samples.

    Raises:
        SolverError: if there is none.

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
    raise SolverError(
        "the filter has no steady state that can be computed.",
        hint="Give noise that fits the sensors, or leave out modes far above the samples.",
    )


def _corrected(x: Array, P: Array, c: Array, r: float, z: float) -> float:
    """Take in a sample z of c x with the variance r, in place; the squared innovation [1]."""
    p = P @ c
    s, e = float(c @ p) + r, z - float(c @ x)
    x += p * (e / s)
    P -= np.outer(p, p / s)
    return e * e / s


@typed
def tracker(  # noqa: PLR0913  keywords of one call
    body: FlexibleBody,
    sensors: Sequence[Sensors],
    forces: Channels,
    wanted: Sequence[Sensors],
    *,
    dt: float,
    walk: float,
    fixed: Any = (),
    unmodelled: float = 0.0,
    first: float | None = None,
) -> Tracker:
    """A filter that estimates forces, and motion and stress anywhere, from a few sensors.

    Args:
        body: with its outer surface, damped, in SI units.
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
    if body.units != "SI":
        raise ConfigError(f"the body is in {body.units}; track it in SI units.")
    dt, walk = positive("dt", dt), positive("walk", walk)
    first = walk if first is None else positive("first", first)
    if finite("unmodelled", unmodelled, ()) < 0:
        raise ConfigError(f"unmodelled = {unmodelled} is negative.")
    modes = _Modes.of(body, fixed, forces.rows(body, "force"))
    C, W = modes.rows(body, sensors, "sensor"), modes.rows(body, wanted, "wanted value")
    n_e, m = modes.driven.shape[1], modes.omega.size
    if len(C) < n_e:
        raise ConfigError(
            f"{len(C)} sensors for {n_e} unknown forces.",
            hint="Add sensors, or join forces that have one history.",
        )
    R = np.concatenate([np.full(len(s.names), s.noise**2.0) for s in sensors])
    if not R.all():
        raise ConfigError("a sensor has no noise: give its standard deviation.")
    A = modes.generator()
    _check_seen(A, C, modes)
    white = np.r_[np.zeros(m), np.full(m, unmodelled**2), np.full(n_e, walk**2)]
    step, Q = discrete(A, np.diag(white), dt)
    P = np.diag(np.r_[np.zeros(2 * m), np.full(n_e, first**2)])
    inputs, outputs = (
        tuple((name, UNITS[s.quantity]) for s in several for name in s.names)
        for several in (sensors, wanted)
    )
    return Tracker(dt, step, Q, C, R, W, P, n_e, inputs, outputs)


def discrete(A: Array, white: Array, dt: float) -> tuple[Array, Array]:
    """Transition (n, n) over a step, and covariance (n, n) of what white noise adds.

    A short step by Van Loan's exponential, then doublings, which do not overflow for modes far
    above the samples.

    Args:
        A: (n, n) rates of the state [1/s].
        white: (n, n) intensity of the noise.
        dt: step [s].
    """
    n = len(A)
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(A).sum(axis=1).max() * dt / MAX_NORM, 1.0)))))
    h = dt / 2.0**halvings
    E = expm(np.block([[-A, white], [np.zeros((n, n)), A.T]]) * h)
    step = E[n:, n:].T
    Q = step @ E[:n, n:]
    for _ in range(halvings):
        Q = Q + step @ Q @ step.T
        step = step @ step
    return step, 0.5 * (Q + Q.T)


@dataclass(frozen=True, slots=True)
class _Modes:
    """Modes of a body and the forces on them."""

    omega: Array
    V: Array
    XI: Array
    driven: Array

    @staticmethod
    def of(body: FlexibleBody, fixed: Any, forces: Array) -> "_Modes":
        omega, V = body.modes(fixed=fixed)
        if not omega.size:
            raise ConfigError(f"body {body.name!r} cannot move with {fixed!r} held.")
        XI = V[6:].T @ body.D @ V[6:]
        XI[omega == 0], XI[:, omega == 0] = 0.0, 0.0  # rigid motion is not damped
        return _Modes(omega, V, XI, (forces @ V).T)

    @property
    def scale(self) -> Array:
        return np.maximum(self.omega, 1.0)

    def generator(self) -> Array:
        """(n, n) rates of the state."""
        m, n_e = self.driven.shape
        A, at = np.zeros((2 * m + n_e,) * 2), np.arange(m)
        A[at, m + at] = self.scale
        A[m : 2 * m] = self._accelerations()
        return A

    def _accelerations(self) -> Array:
        """(m, n) accelerations of the modes by the state."""
        return np.hstack([np.diag(-(self.omega**2) / self.scale), -self.XI, self.driven])

    def rows(self, body: FlexibleBody, several: Sequence[Sensors], what: str) -> Array:
        """(k, n) values of channels by the state."""
        m, n_e = self.driven.shape
        rest = np.zeros((m, n_e))
        parts = {
            "displacement": np.hstack([np.diag(1 / self.scale), np.zeros((m, m)), rest]),
            "velocity": np.hstack([np.zeros((m, m)), np.eye(m), rest]),
            "acceleration": self._accelerations(),
        }
        found = [np.zeros((0, 2 * m + n_e))]
        for s in several:
            if s.quantity == "stress":
                static, inertial = stress_rows(body, s.channels, what)
                value = static @ self.V[6:] @ parts["displacement"]
                value = value + inertial @ self.V @ parts["acceleration"]
            else:
                value = s.channels.rows(body, what) @ self.V @ parts[s.quantity]
            found.append(value)
        return np.vstack(found)


def stress_rows(body: FlexibleBody, channels: Channels, what: str) -> tuple[Array, Array]:
    """Normal stress along channels by elastic coordinates (k, r) [Pa], and by accelerations.

    The latter (k, 6 + r), of rigid and elastic coordinates, is that of modes left out.

    Args:
        body: with stress on its surface.
        channels: where, and along which direction.
        what: they are, for messages.

    Raises:
        ConfigError: if a channel is off the body.
        ModelError: if the body knows no stress.
    """
    recovery = body.stress
    if recovery is None:
        raise ModelError(f"body {body.name!r} carries no stress.", hint="Reduce with stress=True.")
    reach = POINT_RTOL * np.ptp(recovery.points, axis=0).max()
    n_r = body.n_modes
    extra = recovery.inertial
    left_out = np.zeros((len(recovery.operator), 6 + n_r))
    if extra is not None:
        left_out = np.hstack([extra[:, :6], extra[:, -n_r:]])
    static, inertial = [], []
    directions = np.asarray(channels.directions)
    for k, (x, d) in enumerate(zip(np.asarray(channels.points), directions, strict=True)):
        far = np.linalg.norm(recovery.points - x, axis=1)
        n = int(far.argmin())
        if far[n] > reach:
            raise ConfigError(f"{what} {k} at {x.tolist()} is {far[n]:.3g} m off the body.")
        a, b, c = d / np.linalg.norm(d)
        along = np.array([a * a, b * b, c * c, 2 * b * c, 2 * a * c, 2 * a * b])
        static.append(along @ recovery.operator[6 * n : 6 * n + 6])
        inertial.append(along @ left_out[6 * n : 6 * n + 6])
    return np.array(static), np.array(inertial)


def _check_seen(A: Array, C: Array, modes: _Modes) -> None:
    """Refuse what lasts and is not seen: at each undamped root of A, after Popov and Hautus.

    Raises:
        ModelError: naming the force or the motion.
    """
    m, n_e = modes.driven.shape
    scale = np.r_[np.ones(2 * m), 1 / np.maximum(np.abs(modes.driven).max(axis=0), 1e-300)]
    A, C = A * scale / scale[:, None], C * scale
    C = C / np.maximum(np.abs(C).max(axis=1, keepdims=True), 1e-300)
    undamped = (np.diag(modes.XI) <= DAMPED_RTOL * modes.omega) & (modes.omega > 0)
    for root in (0.0, *(1j * modes.omega[undamped])):
        test = A - root * np.eye(len(A))
        test = test / np.maximum(np.abs(test).max(axis=1, keepdims=True), 1e-300)
        _, size, Vh = np.linalg.svd(np.vstack([test, C]))
        if size[-1] > UNSEEN_STATE_RTOL * size[0]:
            continue
        x = np.abs(Vh[-1])
        unseen = [f"force {k}" for k in range(n_e) if x[2 * m + k] > 0.1 * x.max()]
        unseen += [
            f"the motion at {w / (2 * np.pi):.4g} Hz"
            for k, w in enumerate(modes.omega) if max(x[k], x[m + k]) > 0.1 * x.max()
        ]  # fmt: skip
        raise ModelError(
            f"the sensors do not see {named(unseen)}, which would drift.",
            hint="Add a displacement or a stress: accelerations do not see what stands still.",
        )
