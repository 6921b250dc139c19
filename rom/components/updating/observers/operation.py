"""A body in operation as equations of first order, with their derivatives by its parameters.

State: s y and y' of modes, s the larger of frequency and one, then forces::

    M(p) y'' + Xi y' + K(p) y = Phi' f,   K = sum k_i(p) K_i,   M alike

Modes are those at factors of one. Sensors and what is wanted are rows of the state, accelerations
by the equation of motion.

Source:
    Noise of a step: Van Loan, Computing integrals involving the matrix exponential, IEEE Trans.
    Autom. Control 23 (1978) 395; its derivative: Najfeld and Havel, Derivatives of the matrix
    exponential and their computation, Adv. Appl. Math. 16 (1995) 321.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from scipy.linalg import eigh, expm, expm_frechet

from rom.arguments import typed
from rom.arguments.quantities import NotNegative
from rom.body.flexible import FlexibleBody
from rom.body.recovery import StressRecovery
from rom.components.updating import family_model
from rom.components.updating.family_model import Attached, FamilyModel, Held, Parts, Structure
from rom.components.updating.measured import POINT_RTOL, Channels
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index
from rom.names import check_known, named

UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s2"}
UNITS |= {"strain": "1", "stress": "Pa"}
UNSEEN_STATE_RTOL = 1e-9  # singular value of a motion that no sensor sees, over the largest
DAMPED_RTOL = 1e-9  # decay over frequency from which on an unseen motion dies out by itself
MAX_NORM = 0.5  # of a matrix whose exponential is summed; longer steps are doublings


@typed
@dataclass(frozen=True, slots=True)
class Sensors:
    """Channels of one kind, measured or wanted.

    Attributes:
        channels: where, and along which direction.
        quantity: "displacement", "velocity", "acceleration", or along the direction the normal
            "strain", in the surface and constant over a triangle of it, or the normal "stress".
        noise: standard deviation of a sample [unit of the quantity]; not used where it is wanted.
    """

    channels: Channels
    quantity: Literal["displacement", "velocity", "acceleration", "strain", "stress"]
    noise: Annotated[float, NotNegative()] = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Quantity and number from one of each channel."""
        n = len(np.asarray(self.channels.points))
        return tuple(f"{self.quantity}[{k}]" for k in range(1, n + 1))


@dataclass(frozen=True, slots=True)
class Rows:
    """What sensors see of m modes; n_t terms have factors."""

    displacement: Array  # (k, m) of y [unit of a sensor / (m kg^(1/2))]
    carried: Array  # (n_t, k, m) of y, times the factor of a term of the stiffness
    velocity: Array  # (k, m) of y'
    acceleration: Array  # (k, m) of y''


@dataclass(frozen=True, slots=True)
class Linear:
    """The equations at one point of the parameters, with their derivatives there."""

    A: Array  # (n, n) rates of the state [1/s]
    dA: Array  # (n_p, n, n) by the logarithms of factors
    C: Array  # (n_y, n) what sensors see [unit of a sensor / unit of a state]
    dC: Array  # (n_p, n_y, n) likewise
    W: Array  # (n_v, n) what is wanted
    dW: Array  # (n_p, n_v, n) likewise


@dataclass(frozen=True, slots=True)
class Operation:
    """Modes of a body, forces on them, and what is seen."""

    model: FamilyModel  # in its modes at factors of one, of the parameters that change
    omega: Array  # (m,) frequencies of these modes [rad/s]
    XI: Array  # (m, m) damping [1/s]
    driven: Array  # (m, n_e) forces of the modes per force
    seen: Rows
    wanted: Rows

    @property
    def scale(self) -> Array:
        """(m,) what makes a velocity of a displacement [rad/s]."""
        return np.maximum(self.omega, 1.0)

    def at(self, x: Array) -> Linear:
        """The equations at logarithms x (n_p,) of factors."""
        m, n_e = self.driven.shape
        here = self.model.at(x)
        acc = np.linalg.solve(here.M, np.hstack([-here.K / self.scale, -self.XI, self.driven]))
        right = -here.dM @ acc
        right[..., :m] -= here.dK / self.scale
        dacc = np.linalg.solve(here.M, right)
        A = np.zeros((2 * m + n_e,) * 2)
        A[:m, m : 2 * m], A[m : 2 * m] = np.diag(self.scale), acc
        dA = np.zeros((x.size, *A.shape))
        dA[:, m : 2 * m] = dacc
        found = []
        for rows in (self.seen, self.wanted):
            y, dy = family_model.summed(rows.carried, self.model.k_powers, x)
            C = rows.acceleration @ acc
            C[:, :m] += (y + rows.displacement) / self.scale
            C[:, m : 2 * m] += rows.velocity
            dC = rows.acceleration @ dacc
            dC[..., :m] += dy / self.scale
            found += [C, dC]
        return Linear(A, dA, *found)


def operation(
    structure: Structure,
    names: Sequence[str],
    attached: Attached,
    channels: tuple[Sequence[Sensors], Channels, Sequence[Sensors]],
    damping: float | None,
    fixed: Held,
) -> Operation:
    """The equations of a body, an assembly or a family, see `tracker` and `parameter_tracker`.

    Names are those of parameters that change; channels are sensors, forces and what is wanted. The
    damping ratio of all modes at factors of one is that of the bodies where it is None.
    """
    parts = Parts.of(structure)
    nothing = np.eye(parts.n), np.zeros((0, parts.n))
    model = family_model.family_model(structure, nothing, attached, {}, fixed)
    for name in names:
        check_known(name, model.names, f"no parameter {name!r} of family or attached; there are")
    if not model.K.shape[1]:
        what = named(body.name for body in parts.bodies.values())
        raise ConfigError(f"body {what} cannot move with {fixed!r} held; leave one of them free.")
    lam, U = eigh(model.K.sum(axis=0), model.M.sum(axis=0))
    omega, V = np.sqrt(np.maximum(lam, 0.0)), model.sensors @ U
    omega[: model.n_rigid] = 0.0
    XI = np.diag(2 * (damping or 0.0) * omega)
    if damping is None:
        for name, body in parts.bodies.items():
            elastic = V[parts.columns[name]][6:]
            XI += elastic.T @ body.D @ elastic
        XI[: model.n_rigid], XI[:, : model.n_rigid] = 0.0, 0.0  # rigid motion is not damped
    chosen = [model.names.index(name) for name in names]
    sensors, forces, wanted = channels
    terms = family_model.terms_of(structure)
    seen = _rows(parts, terms, V, sensors, "sensor", len(attached))
    asked = _rows(parts, terms, V, wanted, "wanted value", len(attached))
    driven = (forces.rows(parts.bodies, "force") @ V).T
    small = model.reduced(U, np.array(chosen, dtype=int), np.zeros(len(model.names)), V)
    return Operation(small, omega, XI, driven, seen, asked)


def _rows(
    parts: Parts,
    terms: list[tuple[str, FlexibleBody]],
    V: Array,
    several: Sequence[Sensors],
    what: str,
    n_attached: int,
) -> Rows:
    k, m, order = sum(len(s.names) for s in several), V.shape[1], ("displacement", "velocity")
    rows = {name: np.zeros((k, m)) for name in (*order, "acceleration")}
    carried, first = np.zeros((len(terms) + n_attached, k, m)), 0
    for s in several:
        own = np.arange(first, first + len(s.names))
        first += own.size
        if s.quantity != "stress":
            seen = s.channels.rows(parts.bodies, what, gauges=s.quantity == "strain") @ V
            rows["displacement" if s.quantity == "strain" else s.quantity][own] = seen
            continue
        owners = np.array(s.channels.owners(parts.bodies, what))
        for t, (name, term) in enumerate(terms):
            lies, here = np.flatnonzero(owners == name), V[parts.columns[name]]
            if not lies.size:
                continue
            static, inertial = stress_rows(term, s.channels, what, lies)
            carried[t, own[lies]] = static @ here[6:]
            rows["acceleration"][own[lies]] += inertial @ here
    return Rows(rows["displacement"], carried, rows["velocity"], rows["acceleration"])


def stress_rows(
    body: FlexibleBody, channels: Channels, what: str, chosen: Index | None = None
) -> tuple[Array, Array]:
    """Normal stress along channels by elastic coordinates (k, r) [Pa], and by accelerations.

    The latter (k, 6 + r), of rigid and elastic coordinates, is that of modes left out. Of chosen
    channels (k,), or all.
    """
    recovery = body.stress
    if recovery is None:
        raise ModelError(f"body {body.name!r} carries no stress.", hint="Reduce with stress=True.")
    if not isinstance(recovery, StressRecovery):
        raise ModelError(
            f"the stress of body {body.name!r} is that of large deflection, and what is estimated "
            "here is linear.",
            hint="Reduce without nonlinear.",
        )
    reach = POINT_RTOL * np.ptp(recovery.points, axis=0).max()
    n_r, left_out = body.n_modes, np.zeros((len(recovery.operator), 6 + body.n_modes))
    if (extra := recovery.inertial) is not None:
        left_out = np.hstack([extra[:, :6], extra[:, -n_r:]])
    static, inertial = [np.zeros((0, n_r))], [np.zeros((0, 6 + n_r))]
    for k in range(len(np.asarray(channels.points))) if chosen is None else chosen:
        x, d = np.asarray(channels.points)[k], np.asarray(channels.directions)[k]
        far = np.linalg.norm(recovery.points - x, axis=1)
        n = int(far.argmin())
        if far[n] > reach:
            off = f"{what} {k} is {far[n]:.3g} m off the body"
            raise ConfigError(f"{off}; at most {reach:.3g} m may be.")
        a, b, c = d / np.linalg.norm(d)
        along = np.array([a * a, b * b, c * c, 2 * b * c, 2 * a * c, 2 * a * b])
        static.append(along @ recovery.operator[None, 6 * n : 6 * n + 6])
        inertial.append(along @ left_out[None, 6 * n : 6 * n + 6])
    return np.vstack(static), np.vstack(inertial)


def check_seen(at: Linear, body: Operation) -> None:
    """Refuse what lasts and is not seen: at each undamped root of A, after Popov and Hautus."""
    m, n_e = body.driven.shape
    scale = np.r_[np.ones(2 * m), 1 / np.maximum(np.abs(body.driven).max(axis=0), 1e-300)]
    A, C = at.A * scale / scale[:, None], at.C * scale
    C = C / np.maximum(np.abs(C).max(axis=1, keepdims=True), 1e-300)
    undamped = (np.diag(body.XI) <= DAMPED_RTOL * body.omega) & (body.omega > 0)
    for root in (0.0, *(1j * body.omega[undamped])):
        test = A - root * np.eye(len(A))
        test = test / np.maximum(np.abs(test).max(axis=1, keepdims=True), 1e-300)
        _, size, Vh = np.linalg.svd(np.vstack([test, C]))
        if size[-1] > UNSEEN_STATE_RTOL * size[0]:
            continue
        x = np.abs(Vh[-1])
        unseen = [f"force {k}" for k in range(n_e) if x[2 * m + k] > 0.1 * x.max()]
        moving = np.maximum(x[:m], x[m : 2 * m]) > 0.1 * x.max()
        unseen += [f"the motion at {f:.4g} Hz" for f in body.omega[moving] / (2 * np.pi)]
        text = f"the sensors do not see {named(unseen)}, which would drift."
        hint = "Add a displacement or a stress: accelerations do not see what stands still."
        raise ModelError(text, hint=hint)


def discrete(A: Array, white: Array, dt: float) -> tuple[Array, Array]:
    """Transition (n, n) over a step, and covariance (n, n) of what white noise adds.

    A short step by Van Loan's exponential, then doublings, which do not overflow for modes far
    above the samples.
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


def step_derivatives(A: Array, dA: Array, dt: float) -> Array:
    """(n_p, n, n) derivatives of the transition exp(A dt) along dA (n_p, n, n) [1/s]."""
    found = [expm_frechet(A * dt, B * dt, compute_expm=False) for B in dA]
    return np.array(found).reshape(dA.shape)
