"""Least squares over responses and over equations, and the response function method.

Source:
    After Berriet, Fillod and Bouhaddi; the response function method is that of Lin and Ewins.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from rom.arguments import Count, matrix, typed, whole
from rom.components.updating import models
from rom.components.updating.frf_data import Complex
from rom.components.updating.models import AtSensors, Measurement, Modal, Model, ParametricModel
from rom.errors import ConfigError
from rom.model import Array, Report

MAX_EVALUATIONS = 100  # evaluations of the responses; more are needed if the start is too far away
BLOCK_LINES = 256  # at once: some ten megabytes of derivatives for sixty channels
MAX_STEPS = 40  # linear solutions
STEP_ATOL = 1e-8  # in standard deviations, below which equations are solved
MAX_PARAMETER_CHANGE = 0.2  # in one step
SHRINKING_RATIO = 0.5  # of a step over the one before, above which noise does not lead
MIN_PARAMETER = -0.95  # change that leaves a twentieth of the stiffness or mass
ROUND_OFF = 1e-6  # of a relative error of responses: what is below has no pattern to be judged by
EQUAL_EIGENVALUE_RTOL = 1e-12  # distance of eigenvalues whose modes have no derivative


@dataclass(frozen=True, slots=True)
class Update:
    """What updating found.

    Attributes:
        p: (n_p,) relative changes of stiffness and mass [1].
        zeta: (m,) damping ratios of the lowest elastic modes [1].
        covariance: (n_p + m, n_p + m) of p and ln zeta that the residual implies [1].
        history: (k, n_p) p after each step [1].
        residual: root mean square of the weighted residual [1].
        verdict: whether the responses of the corrected model leave noise alone; None for updates
            that compare none.
    """

    p: Array
    zeta: Array
    covariance: Array
    history: Array
    residual: float
    verdict: Report | None = None

    @property
    def deviation(self) -> Array:
        """(n_p + m,) standard deviations of p and ln zeta [1]."""
        return np.sqrt(np.diag(self.covariance))


def responses(
    model: Model, p: ArrayLike, zeta: ArrayLike, omega: Array, inputs: tuple[int, ...]
) -> Complex:
    """(n_f, n_s, n_e) receptances at the sensors [m/N].

    Args:
        model: with its sensors.
        p: (n_p,) relative changes of stiffness and mass [1].
        zeta: (m,) damping ratios of the lowest elastic modes [1].
        omega: (n_f,) circular frequencies [rad/s].
        inputs: sensors at which forces act.

    Raises:
        ConfigError: for an input that is no sensor, or a frequency that is not finite.
        ModelError: for mass or stiffness not positive.
    """
    here = model.at(p)
    if not set(inputs) <= set(range(len(here.sensors))) or not np.isfinite(omega).all():
        raise ConfigError(f"inputs = {inputs} must be 0 to {len(here.sensors) - 1}, omega finite.")
    modes = models.modal(here, zeta)
    seen = here.sensors @ modes.Phi
    return receptance(seen, modes.g(omega), seen[list(inputs)])


def receptance(seen: Array, g: Complex, driven: Array) -> Complex:
    """(n_f, n_s, n_e) of modes [m/N], (n_s, n) at the sensors, (n_e, n) at the inputs [kg^-1/2].

    The receptance of each mode is (n_f, n) [s^2].
    """
    H = np.empty((len(g), len(seen), len(driven)), dtype=complex)
    for block in blocks(len(g)):
        H[block] = (seen * g[block][:, None, :]) @ driven.T
    return H


def through_modes(
    model: ParametricModel, modes: Modal, m: int, *, shared: bool = False
) -> Callable[[Complex, Complex, Array], Complex]:
    """The function of sides (n_f, a, n), (n_f, n, b) and lines (n_f,) that gives side dZ side.

    Derivatives (n_f, a, b, n_p + m) are those by p, at the origin of the model, and by logarithms
    of the damping ratios of its m lowest elastic modes; the last of these may be shared by all
    other modes. Phi^T dZ Phi is A - omega^2 B + i omega C, each (n_p, n, n), at constant ratios:
    the damping changes with its modes, of whose derivatives divided differences of d remain.
    """
    A, B = (modes.Phi.T @ dA @ modes.Phi for dA in (model.dK, model.dM))
    lam, d = modes.lam, modes.d
    gap = lam - lam[:, None]  # lam_j - lam_i in row i, column j
    apart = np.abs(gap) > EQUAL_EIGENVALUE_RTOL * lam[-1]
    gap = np.where(apart, gap, 1.0)
    C = ((d - d[:, None]) * A - (d * lam[:, None] - d[:, None] * lam) * B) / gap * apart
    i = np.arange(lam.size)
    own = np.divide(d, 2 * lam, out=np.zeros_like(d), where=lam > 0)  # d = 2 zeta sqrt(lam)
    C[:, i, i] = own * (A[:, i, i] - lam * B[:, i, i]) + d * B[:, i, i]
    last = model.n_rigid + m - 1
    e, others = slice(model.n_rigid, last + (not shared)), slice(last, None)

    def change(left: Complex, right: Complex, omega: Array) -> Complex:
        damped = left[:, :, None, e] * np.swapaxes(right[:, e], 1, 2)[:, None]
        w = 1j * omega[:, None, None, None]
        columns = [_through(left, (A, B, C), right, omega), damped * (w * modes.d[e])]
        if shared:
            together = (left[:, :, others] * modes.d[others]) @ right[:, others]
            columns.append(w * together[..., None])
        return np.concatenate(columns, axis=-1)

    return change


def transfer(
    here: ParametricModel, modes: Modal, driven: Array, m: int, *, shared: bool = False
) -> Callable[[Array], tuple[Complex, Complex]]:
    """The function of lines (n_f,) [rad/s] that gives receptances and their derivatives.

    These are (n_f, n_s, n_e) [m/N] and (n_f, n_s, n_e, n_p + m); inputs are rows ``driven``
    (n_e, n) [1], otherwise arguments are those of `through_modes`.
    """
    seen, driven = here.sensors @ modes.Phi, driven @ modes.Phi
    change = through_modes(here, modes, m, shared=shared)

    def at(omega: Array) -> tuple[Complex, Complex]:
        g = modes.g(omega)
        sides = seen * g[:, None, :], g[:, :, None] * driven.T
        return receptance(seen, g, driven), -change(*sides, omega)

    return at


def _through(left: Complex, S: tuple[Array, ...], right: Complex, omega: Array) -> Complex:
    """Left (A - omega^2 B + i omega C) right: (n_f, a, n), (n_q, n, n), (n_f, n, b).

    The narrower side is pushed through all matrices at once; they are symmetric.
    """
    if left.shape[1] < right.shape[2]:
        flipped = _through(np.swapaxes(right, 1, 2), S, np.swapaxes(left, 1, 2), omega)
        return np.swapaxes(flipped, 1, 2)
    n_f, n, b = right.shape
    columns = np.ascontiguousarray(np.moveaxis(right, 1, 0).reshape(n, n_f * b))
    w, pushed = np.repeat(omega, b), np.zeros((), dtype=complex)
    for part, factor in zip(S, (1.0, -(w**2), 1j * w), strict=True):
        if not part.any():
            continue
        pairs = part.reshape(-1, n) @ (columns * factor).view(np.float64)  # a quarter of the work
        pushed = pushed + pairs.view(np.complex128)
    pushed = pushed.reshape(-1, n, n_f, b).transpose(2, 1, 3, 0).reshape(n_f, n, -1)
    return (left @ pushed).reshape(n_f, left.shape[1], b, -1)


def sensitivity(
    model: Model, p: ArrayLike, zeta: ArrayLike, omega: Array, inputs: tuple[int, ...]
) -> tuple[Complex, Complex]:
    """Receptances (n_f, n_s, n_e) [m/N], and derivatives (..., n_p + m) by p and ln zeta.

    Arguments are as of `responses`.

    Raises:
        ConfigError, ModelError: as `responses`.
    """
    here = model.at(p)
    driven, modes = here.sensors[list(inputs)], models.modal(here, zeta)
    return transfer(here, modes, driven, np.size(zeta))(omega)


def update_by_output(model: Model, test: Measurement, p: ArrayLike, zeta: ArrayLike) -> Update:
    """Least squares of ln(H / H_test) over p and ln zeta.

    Each value counts by its relative error, so that antiresonances weigh as much as resonances. The
    ``verdict`` says whether what is left has the size of one noise at all sensors and in all bands.

    The search begins at relative changes p (n_p,) and damping ratios zeta (m,) [1].

    Raises:
        ConfigError: if the test does not fit the model.
        ModelError: for mass or stiffness not positive.
    """
    test.check(model, zeta)
    n_p, path = np.size(p), []

    def residual(x: Array) -> Array:
        H = responses(model, x[:n_p], np.exp(x[n_p:]), test.omega, test.inputs)
        return weighted(test.weights, np.log(H / test.H))

    def jacobian(x: Array) -> Array:
        path.append(x[:n_p].copy())
        H, dH = sensitivity(model, x[:n_p], np.exp(x[n_p:]), test.omega, test.inputs)
        return weighted(test.weights, dH / H[..., None])

    start = np.concatenate([p, np.log(zeta)])
    low = np.repeat([MIN_PARAMETER, -np.inf], [n_p, np.size(zeta)])
    search = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-12) | {"max_nfev": MAX_EVALUATIONS}
    found = least_squares(residual, start, jacobian, (low, np.inf), **search)
    ended = _update(found.x, n_p, found.fun, found.jac, [*path[1:], found.x[:n_p]])
    return _judged(ended, model, test)


def update_by_input(
    model: AtSensors,
    test: Measurement,
    p: ArrayLike,
    zeta: ArrayLike,
    *,
    rank: int,
    limits: tuple[ArrayLike, ArrayLike] = (MIN_PARAMETER, np.inf),
    prior: ArrayLike = np.inf,
) -> Update:
    """Least squares of U^T Z^-1 (Z(p) U U^T y - f): linear in p and zeta in each step.

    U spans the strongest ``rank`` directions of all test and model responses together; both sets
    are condensed with it. The rank, at most the number of sensors, must reach the number of modes
    in the band; p stays within the limits [1]. Equations are summed over blocks of lines.
    The prior (n_p,) is the standard deviation of p about zero before the test [1]; it weighs as
    much as the residual that is left says. Otherwise as `update_by_output`.

    Raises:
        ConfigError: if the test does not fit the model, or has not so many sensors.
        ModelError: for mass or stiffness not positive.
    """
    test.check(model, zeta)
    whole("rank", rank, 1, test.H.shape[1], reason="the sensors")
    n_values = 2 * rank * test.omega.size * len(test.inputs)

    def triangle(x: Array, ratios: Array) -> Array:
        return _equations(model.at(x), test, ratios, rank)

    start = np.array(p, dtype=float), np.array(zeta, dtype=float)
    return _judged(solved(triangle, start, n_values, limits, prior), model, test)


def solved(
    triangle: Callable[[Array, Array], Array],
    start: tuple[Array, Array],
    n_values: int,
    limits: tuple[ArrayLike, ArrayLike],
    prior: ArrayLike,
    prior_damping: tuple[float, float] = (1.0, np.inf),
    enough: float = STEP_ATOL,
) -> Update:
    """Least squares that are linear in p and ln zeta in each step, none longer than 0.2.

    The triangle of p (n_p,) and zeta (m,), see `folded`, is that of derivatives and residual, n + 1
    columns; or of n instruments before them, which noise of the derivatives leaves alone: the
    residual is made normal to these, and they take the place of the derivatives as soon as a step
    is not half as long as the one before. A step of less than enough standard deviations is the
    last. The prior is the standard deviation (n_p,) of p about zero before the test, against what
    is left; that of damping is a ratio and the deviation of its logarithm.
    """
    (x, ratios), path = start, []
    before = np.r_[np.zeros(x.size), np.full(ratios.size, np.log(prior_damping[0]))]
    sigma = np.r_[np.broadcast_to(prior, x.shape), np.full(ratios.size, prior_damping[1])]
    precision, n, last = np.diag(1.0 / sigma), sigma.size, np.inf
    for _ in range(MAX_STEPS):
        R = triangle(x, ratios)
        left = R[:, -1] @ R[:, -1]
        noise = np.sqrt(left / max(n_values - n, 1)) or 1.0
        lead = R[:, -n - 1 : -1] if last else R[:, :n]
        normal_to, J = (np.vstack([A / noise, precision]) for A in (R[:, :n], lead))
        r = np.r_[R[:, -1] / noise, precision @ (np.r_[x, np.log(ratios)] - before)]
        Q = np.linalg.qr(normal_to)[0]
        step = -np.linalg.lstsq(Q.T @ J, Q.T @ r, rcond=None)[0]
        step = np.clip(step, -MAX_PARAMETER_CHANGE, MAX_PARAMETER_CHANGE)
        ratios = ratios * np.exp(step[x.size :])
        step[: x.size] = np.clip(x + step[: x.size], *limits) - x
        x = x + step[: x.size]
        path.append(x)
        moved = float(np.linalg.norm(normal_to @ step))
        if moved < enough:
            break
        last = moved if moved < SHRINKING_RATIO * last else 0.0
    covariance = np.linalg.pinv(normal_to.T @ normal_to, hermitian=True)
    return Update(x, ratios, covariance, np.array(path), np.sqrt(left / n_values))


def _equations(here: ParametricModel, test: Measurement, ratios: Array, rank: int) -> Array:
    """(n + 1, n + 1) triangle with the R^T R of derivatives and residual of all lines together."""
    modes = models.modal(here, ratios)
    at_sensors = here.sensors @ modes.Phi
    H = receptance(at_sensors, modes.g(test.omega), at_sensors[list(test.inputs)])
    U, R = common_basis(test.H, H, rank), np.zeros((0, len(here.dK) + ratios.size + 1))
    weights = test.weights / np.linalg.norm(test.H, axis=(1, 2), keepdims=True)
    weights = weights.mean(axis=1, keepdims=True)
    condensed = modes.Phi.T @ here.M @ U @ U.T  # Phi^-1 = Phi^T M
    seen, change = U.T @ modes.Phi, through_modes(here, modes, ratios.size)
    for block in blocks(test.omega.size):
        omega, w = test.omega[block], weights[block]
        J = change(seen * modes.g(omega)[:, None, :], condensed @ test.H[block], omega)
        r = np.asarray(U.T @ (test.H[block] - H[block]), dtype=complex)
        R = folded(R, np.column_stack([weighted(w, J), weighted(w, r)]))
    return R


@typed
def response_function_method(
    model: ParametricModel,
    test: Measurement,
    p: ArrayLike,
    C: Array,
    *,
    steps: Annotated[int, Count(1)] = 1,
) -> Update:
    """Solve H - H_test = H dZ(p) H_test, linear in p.

    Exact in one step when every dof is measured without noise. Else unmeasured rows of H_test
    follow the measured ones as the model at the last p says. Sensors are dofs.

    The search begins at relative changes p (n_p,) [1], none of which one of several steps changes
    by more than 0.2. The damping C (n, n) is known [N s/m].

    Raises:
        ConfigError: if damping or sensors do not fit the model.

    Source:
        Lin and Ewins, Analytical model improvement using frequency response functions, Mech. Syst.
        Signal Process. 8 (1994) 437.
    """
    test.check(model)
    matrix("C", C, (len(model.K), len(model.K)))
    p, path, s = np.array(p, dtype=float), [], models.sensor_dofs(model)
    clip = MAX_PARAMETER_CHANGE if steps > 1 else np.inf
    o = np.setdiff1d(np.arange(len(model.K)), s)
    w = test.omega[:, None, None]
    F = np.eye(len(model.K))[:, s[list(test.inputs)]]
    for _ in range(steps):
        here = model.at(p)
        Z = here.K - w**2 * here.M + 1j * w * C
        H = np.linalg.inv(Z)[:, s]
        known = np.empty((w.size, *F.shape), dtype=complex)
        known[:, s] = test.H
        known[:, o] = np.linalg.solve(Z[:, o][:, :, o], F[o] - Z[:, o][:, :, s] @ test.H)
        change = _through(H, (model.dK, model.dM, 0 * model.dK), known, test.omega)
        J, r = weighted(test.weights, change), weighted(test.weights, H @ F - test.H)
        step = np.linalg.lstsq(J, r, rcond=None)[0]
        p = np.maximum(p + np.clip(step, -clip, clip), MIN_PARAMETER)
        path.append(p)
    return _update(p, p.size, r - J @ step, J, path)


def common_basis(test: Complex, model: Complex, rank: int) -> Array:
    """(n_s, rank) orthonormal directions [1] of responses (n_f, n_s, n_e) [m/N] of test and model.

    Each response to an input at a line counts by the norm one.
    """
    R = np.zeros((0, test.shape[1]))
    for H in (A[block] for block in blocks(len(test)) for A in (test, model)):
        Y = np.moveaxis(H, 1, 2).reshape(-1, H.shape[1])
        Y = Y / np.linalg.norm(Y, axis=1, keepdims=True)
        R = folded(R, np.vstack([Y.real, Y.imag]))
    return np.linalg.svd(R, full_matrices=False)[2][:rank].T


def blocks(n: int, size: int = 0) -> Iterator[slice]:
    """Lines (n,) piece by piece, so that memory does not grow with their number."""
    size = size or BLOCK_LINES
    return (slice(first, first + size) for first in range(0, n, size))


def folded(R: Array, A: Array) -> Array:
    """(min(m, n), n) triangle with the R^T R of the rows R (.., n) and A (.., n) together.

    Unlike sums of A^T A, triangles keep the digits of small singular values.
    """
    return np.asarray(np.linalg.qr(np.vstack([R, A]), mode="r"))


def _update(x: Array, n_p: int, r: Array, J: Array, path: list[Array]) -> Update:
    variance = (r @ r) / max(r.size - x.size, 1)
    covariance = np.linalg.pinv(J.T @ J) * variance
    return Update(x[:n_p], np.exp(x[n_p:]), covariance, np.array(path), np.sqrt((r @ r) / r.size))


def _judged(found: Update, model: Model, test: Measurement) -> Update:
    """The same with the verdict: whether its responses leave noise alone, of an unknown size.

    What is left of noise with the weights of the test has one size at all sensors and in all
    bands, and the responses are alike.
    """
    H = responses(model, found.p, found.zeta, test.omega, test.inputs)
    weight = np.broadcast_to(np.asarray(test.weights, dtype=float), test.H.shape)
    used = weight > 0
    rows = [models.likeness(H, test.H, used)]
    squares = np.abs(np.log(H / test.H) * weight) ** 2
    freedom = max(2 * int(used.sum()) - found.p.size - found.zeta.size, 1)
    variance = squares.sum() / freedom
    if variance > ROUND_OFF**2:
        rows += models.worst_rows(squares / variance, used, test.omega, scale=2 / freedom)
    return replace(found, verdict=Report("updating", tuple(rows)))


def weighted(weights: Array | float, r: Complex) -> Array:
    """Weighted residual, or its derivatives (.., n_q), real parts above imaginary parts."""
    weights = np.asarray(weights, dtype=float)
    weights = weights[..., None] if r.ndim > 3 and weights.ndim else weights
    return np.concatenate([(part * weights).reshape(-1, *r.shape[3:]) for part in (r.real, r.imag)])
