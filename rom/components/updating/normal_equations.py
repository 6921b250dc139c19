"""Residuals of families: of responses, summed over lines, and of equations at the sensors.

That of responses is ln(H / H_measured) over its standard deviation, real and imaginary part.
Circular noise leaves the mean of the logarithm where it is, as all powers of it have the mean zero.
Equations of motion need the model condensed statically to the sensors, which is wrong by inertia
between them however good the data are; the verdict, of responses of the model that is not
condensed, says how much.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import null_space, qr

from rom.arguments import whole
from rom.components.updating import methods
from rom.components.updating.family_model import FamilyModel
from rom.components.updating.frf_data import Complex
from rom.components.updating.measured import Responses
from rom.components.updating.methods import Update
from rom.components.updating.models import AtSensors, Measurement
from rom.errors import ConfigError
from rom.model import Array, Index, Mask
from rom.names import named

ROUGH_LINES = 500  # at most: enough to see resonances
ROUGH_ERROR = 0.3  # of responses, with which the search begins
SENSOR_RTOL = 1e-8  # singular value of sensors that follow others, over the largest
LAST_STEP = 1e-3  # in standard deviations
COLLOCATED_RTOL = 1e-8  # of the row of a sensor that measures what an input drives


@dataclass(frozen=True, slots=True)
class Data:
    """Logarithms of responses and what they are worth; the last four as of `Errors`."""

    omega: Array  # (n_f,) lines [rad/s]
    logarithm: Complex  # (n_f, n_s, n_e) ln of displacement per force
    weight: Array  # (n_f, n_s, n_e) one over the standard deviation of both parts; 0 if not used
    common: Array | float = 0.0
    varied: Array | float = 0.0
    known: float = 1.0
    scale: float = 0.0

    @staticmethod
    def of(test: Responses, excess: Array | float = 0.0) -> "Data":
        """What a test says; by the level of a model beside it, see `Noise.errors`."""
        e, omega = test.noise.errors(excess), 2 * np.pi * test.frequencies
        return Data(omega, test.logarithm(), 1.0 / e.own, e.common, e.varied, e.known, e.scale)

    def lines(self, chosen: Index | slice) -> "Data":
        """Some of the lines."""
        names = ("omega", "logarithm", "weight", "common", "varied")
        every = {name: getattr(self, name) for name in names}
        return replace(self, **{name: x[chosen] for name, x in every.items() if np.ndim(x)})

    def roughly(self) -> "Data":
        """Lines at even distances, with errors that are large enough to start from afar."""
        few = self.lines(np.arange(0, self.omega.size, -(-self.omega.size // ROUGH_LINES)))
        return replace(few, weight=np.minimum(few.weight, 1 / ROUGH_ERROR), common=0.0, varied=0.0)

    @property
    def n_values(self) -> int:
        """Number of real residuals."""
        return 2 * int(np.count_nonzero(self.weight))


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over all lines; `varied` is what the information is worth less by estimated weights."""

    normal: Array  # (n_q, n_q) J^T J
    gradient: Array  # (n_q,) J^T r
    squares: Array  # (n_f, n_s, n_e) squared residuals, of real and imaginary part together
    varied: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (n_q, n_q)

    @property
    def chi_square(self) -> float:
        """Sum of all squared residuals."""
        return float(self.squares.sum())


def responses_at(model: FamilyModel, x: Array, ratios: Array, omega: Array) -> Complex:
    """(n_f, n_s, n_e) receptances [m/N] at lines (n_f,) [rad/s] and logarithms x (n_p,) of factors.

    Damping ratios (m,) are those of the lowest elastic modes, the last one of all others too [1].
    """
    modes = model.modal(model.at(x), ratios)
    return methods.receptance(model.sensors @ modes.Phi, modes.g(omega), model.driven @ modes.Phi)


def sensitivity(
    model: FamilyModel, x: Array, ratios: Array
) -> Callable[[Array], tuple[Complex, Complex]]:
    """As `transfer`, by logarithms of factors and of ratios; arguments as of `responses_at`."""
    here = model.at(x)
    modes = model.modal(here, ratios)
    return methods.transfer(here, modes, model.driven, ratios.size, shared=True)


def sums(model: FamilyModel, x: Array, ratios: Array, data: Data) -> Sums:
    """J^T J and J^T r by logarithms of factors and of damping ratios, as of `responses_at`."""
    n = x.size + ratios.size
    normal, varied, gradient = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    squares = np.zeros(data.weight.shape)
    at = sensitivity(model, x, ratios)
    for block in methods.blocks(data.omega.size):
        some = data.lines(block)
        w = some.weight
        H, J = at(some.omega)
        log = wrapped(np.log(H) - some.logarithm) * (w > 0)
        J = white(J / H[..., None], w, some.common)
        r = white(log[..., None], w, some.common)[..., 0]
        normal += _gram(J, n)
        gradient += (J.reshape(-1, n).conj().T @ r.ravel()).real
        squares[block] = np.abs(r) ** 2
        if np.any(some.varied):
            varied += _gram(unsure(J, w, some.common, some.varied), n)
    return Sums(normal, gradient, squares, varied)


def _gram(J: Complex, n: int) -> Array:
    flat = J.reshape(-1, n)
    return np.asarray((flat.conj().T @ flat).real)


def unsure(J: Complex, weight: Array, common: Array | float, varied: Array | float) -> Complex:
    """(n_f, n_s, n_e, n) derivatives of which J^H J is what estimated weights cost.

    With V = D^-1 + c^2 1 1^T and own variances d = 1 / D that vary by (v d)^2, estimates by
    weights that vary have the covariance N^-1 + N^-1 Q N^-1, to second order, where
    Q = J^T V^-1 diag(V^-1) v^2 d^2 V^-1 J. J is that of residuals that are white, see `white`.

    Source:
        Kackar and Harville, Approximations for standard errors of estimators of fixed and random
        effects in mixed linear models, J. Am. Stat. Assoc. 79 (1984) 853.
    """
    w, d = np.where(weight > 0, weight, 1.0), weight**2
    c = common**2
    own = 1 - c * d / (1 + c * d.sum(axis=1, keepdims=True))
    return white(J / w[..., None], weight, common) * (varied * np.sqrt(own))[..., None]


def white(log: Complex, weight: Array, common: Array | float) -> Complex:
    """(n_f, n_s, n_e, n) logarithms whose errors become independent and of the variance one.

    Errors have the covariance D^-1 + c^2 1 1^T over the sensors, D = weight^2. With s the
    sum of D and k = 1 - 1 / sqrt(1 + c^2 s), D^(1/2) (1 - k 1 1^T D / s) makes it the identity.
    Weights and the errors c in common are those of `Data`.
    """
    if np.any(common):
        d = weight[..., None] ** 2
        s = np.maximum(d.sum(axis=1, keepdims=True), np.finfo(float).tiny)
        share = 1 - 1 / np.sqrt(1 + np.asarray(common)[..., None] ** 2 * s)
        log = log - share * (d * log).sum(axis=1, keepdims=True) / s
    return weight[..., None] * log


def wrapped(log: Complex) -> Complex:
    """The logarithm with its phase between -pi and pi."""
    return log - 2j * np.pi * np.round(log.imag / (2 * np.pi))


def in_sensors(model: FamilyModel, x: Array, free: Mask) -> FamilyModel:
    """A family in coordinates of which the first are its sensors, the others no sensor sees.

    Of logarithms x (n_p,) of factors those that are not sought stay.
    """
    S = model.sensors
    R, order = qr(S.T, mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    if (rank := int(np.count_nonzero(size > SENSOR_RTOL * size[0]))) < len(S):
        raise ConfigError(
            f"sensors {named(sorted(map(int, order[rank:])))} of {len(S)} follow from others in a "
            f"family of {S.shape[1]} coordinates: equations need independent ones.",
            hint="Leave them out, reduce with more modes, or update by responses.",
        )
    basis = np.hstack([np.linalg.pinv(S), null_space(S)])
    return model.reduced(basis, free, x, np.eye(len(S), S.shape[1]))


def by_equations(
    model: FamilyModel,
    data: Data,
    x: Array,
    free: Mask,
    damping: float,
    *,
    prior: Array,
    rank: int | None,
) -> Update:
    """Logarithms of factors, and damping ratios of the modes up to the highest line.

    Those free (n_p,) are sought from x (n_p,) on, about zero with prior standard deviations (n_p,),
    by a basis of a rank that tests and models share; None for what the modes need. Lines with a
    value that does not count are left out.
    """
    lines = _whole_lines(data)
    inputs, signs = _collocated(model)
    m = int(np.count_nonzero(model.elastic(x) <= data.omega[lines[-1]] ** 2))
    n_s, needed = len(model.sensors), m + model.n_rigid
    if n_s < needed:
        raise ConfigError(
            f"{n_s} sensors for {needed} modes up to the highest line, rigid ones included: "
            "equations at the sensors need one for each.",
            hint="Leave out the highest lines, or update by responses.",
        )
    H = np.exp(data.logarithm[lines]) * signs
    test = Measurement(data.omega[lines], H, inputs, data.weight[lines])
    inside = in_sensors(model, x, free)
    small = AtSensors(inside)
    rank = whole("rank", min(n_s, needed) if rank is None else rank, 1, n_s, reason="sensors")
    start = x[free], np.full(m, damping)
    return methods.update_by_input(
        small, test, *start, rank=rank, limits=inside.ends, prior=prior[free]
    )


def by_response_functions(
    model: FamilyModel,
    data: Data,
    x: Array,
    free: Mask,
    ratios: Array,
    *,
    prior: Array,
    prior_damping: tuple[float, float],
) -> Update:
    """Logarithms of factors, and damping ratios, by H - H_test = H dZ H_test, linear in each step.

    What is not measured of H_test follows its sensors as the model at the last step says, so that
    nothing is condensed; inputs need no sensors. Noise of H_test is in these derivatives too: they
    lead, and those of the model, which have none, say where the end is. All is divided by H_test,
    as the mean of H / H_test is one where errors are circular. Ratios to start from are as of
    `responses_at`; that before the test comes with the deviation of its logarithm.

    Source:
        Lin and Ewins, Analytical model improvement using frequency response functions, Mech. Syst.
        Signal Process. 8 (1994) 437; instruments: Soderstrom and Stoica, System identification
        (1989), chapter 8.
    """
    used = data.lines(_whole_lines(data))
    inside, n_s = in_sensors(model, x, free), len(model.sensors)
    F = inside.driven.T

    def triangle(x: Array, ratios: Array) -> Array:
        here = inside.at(x)
        modes = model.modal(here, ratios)
        change = methods.through_modes(here, modes, ratios.size, shared=True)
        MPhi = here.M @ modes.Phi
        driven, n = modes.Phi.T @ F, x.size + ratios.size
        C, R = (MPhi * modes.d) @ MPhi.T, np.zeros((0, 2 * n + 1))
        for block in methods.blocks(used.omega.size):
            some = used.lines(block)
            w, test, g = some.omega, np.exp(some.logarithm), modes.g(some.omega)
            Z = here.K - w[:, None, None] ** 2 * here.M + 1j * w[:, None, None] * C
            unseen = np.linalg.solve(Z[:, n_s:, n_s:], F[n_s:] - Z[:, n_s:, :n_s] @ test)
            left = modes.Phi[:n_s] * g[:, None, :]
            H = left @ driven
            instruments = change(left, g[:, :, None] * driven, w) / H[..., None]
            J = change(left, MPhi.T @ np.concatenate([test, unseen], axis=1), w) / test[..., None]
            columns = np.concatenate([instruments, J, (1 - H / test)[..., None]], axis=-1)
            R = methods.folded(R, methods.weighted(1.0, white(columns, some.weight, some.common)))
        return R

    options = 2 * used.logarithm.size, inside.ends, prior[free], prior_damping
    return methods.solved(triangle, (x[free], ratios), *options, enough=LAST_STEP)


def _whole_lines(data: Data) -> Index:
    """Numbers of the lines of which every value counts."""
    lines = np.flatnonzero((data.weight > 0).all(axis=(1, 2)))
    if not lines.size:
        text = "no line counts for all sensors and inputs"
        raise ConfigError(f"{text}; leave out the sensor of low coherence, or update by responses.")
    return lines


def _collocated(model: FamilyModel) -> tuple[tuple[int, ...], Array]:
    """Numbers of the sensors at which inputs act, and (n_e,) the signs of their directions."""
    found = []
    for k, row in enumerate(model.driven):
        signs = np.array([1.0, -1.0])[:, None]
        off = np.linalg.norm(model.sensors[None] - signs[..., None] * row, axis=2)
        sign, sensor = np.unravel_index(off.argmin(), off.shape)
        if off.min() > COLLOCATED_RTOL * np.linalg.norm(row):
            text = f"input {k} has no sensor at its point and along its direction."
            hint = "Equations at the sensors need one there; update by responses without."
            raise ConfigError(text, hint=hint)
        found.append((int(sensor), signs[int(sign), 0]))
    return tuple(sensor for sensor, _ in found), np.array([sign for _, sign in found])
