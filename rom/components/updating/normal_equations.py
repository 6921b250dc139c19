"""Residuals of responses and their sums over lines: memory does not grow with their number.

The residual is ln(H / H_measured) over its standard deviation, real and imaginary part. Circular
noise leaves the mean of the logarithm where it is, as all powers of it have the mean zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.components.updating.family_model import FamilyModel
from rom.components.updating.frf_data import Complex
from rom.components.updating.measured import Responses
from rom.components.updating.methods import blocks, receptance, transfer
from rom.model import Array, Index

ROUGH_LINES = 500  # at most: enough to see resonances
ROUGH_ERROR = 0.3  # of responses, with which the search begins


@dataclass(frozen=True, slots=True)
class Data:
    """Logarithms of responses and what they are worth.

    Attributes:
        omega: (n_f,) lines [rad/s].
        logarithm: (n_f, n_s, n_e) ln of displacement per force.
        weight: (n_f, n_s, n_e) one over the standard deviation of both its parts; 0 for values
            that are not used.
        common: (n_f, 1, n_e) or one standard deviation of the error that all sensors of a line and
            an input share.
        varied: (n_f, n_s, n_e) or one standard deviation of the squared errors of sensors over
            themselves, where they are estimated.
        known: degrees of freedom of chi-square for each residual.
        scale: relative variance of all squared errors of sensors together.
    """

    omega: Array
    logarithm: Complex
    weight: Array
    common: Any = 0.0
    varied: Any = 0.0
    known: float = 1.0
    scale: float = 0.0

    @staticmethod
    def of(test: Responses, excess: Any = 0.0) -> "Data":
        """What a test says; by the level of a model beside it, see `Noise.errors`."""
        e, omega = test.noise.errors(excess), 2 * np.pi * test.frequencies
        return Data(omega, test.logarithm(), 1.0 / e.own, e.common, e.varied, e.known, e.scale)

    def lines(self, chosen: Index | slice) -> "Data":
        """Some of the lines."""
        names = ("omega", "logarithm", "weight", "common", "varied")
        of_lines = {name: x for name in names if np.ndim(x := getattr(self, name))}
        return replace(self, **{name: x[chosen] for name, x in of_lines.items()})

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
    """Sums over all lines.

    Attributes:
        normal: (n_q, n_q) J^T J.
        gradient: (n_q,) J^T r.
        squares: (n_f, n_s, n_e) squared residuals, of real and imaginary part together.
        varied: (n_q, n_q) what the information is worth less as weights are estimated.
    """

    normal: Array
    gradient: Array
    squares: Array
    varied: Any = 0.0

    @property
    def chi_square(self) -> float:
        """Sum of all squared residuals."""
        return float(self.squares.sum())


def responses_at(model: FamilyModel, x: Array, ratios: Array, omega: Array) -> Complex:
    """(n_f, n_s, n_e) receptances [m/N].

    Args:
        model: the family with its sensors.
        x: (n_p,) logarithms of its factors.
        ratios: (m,) damping ratios of the lowest elastic modes, the last one of all others too [1].
        omega: (n_f,) lines [rad/s].
    """
    modes = model.modal(model.at(x), ratios)
    return receptance(model.seen @ modes.Phi, modes.g(omega), model.driven @ modes.Phi)


def sensitivity(
    model: FamilyModel, x: Array, ratios: Array
) -> Callable[[Array], tuple[Complex, Complex]]:
    """As `transfer`, by logarithms of factors and of ratios; arguments as of `responses_at`."""
    here = model.at(x)
    modes = model.modal(here, ratios)
    return transfer(here, modes, model.driven, ratios.size, shared=True)


def sums(model: FamilyModel, x: Array, ratios: Array, data: Data) -> Sums:
    """J^T J and J^T r by the logarithms of factors and of damping ratios.

    Args:
        model: see `responses_at`.
        x: see `responses_at`.
        ratios: see `responses_at`.
        data: what was measured.
    """
    n = x.size + ratios.size
    normal, varied, gradient = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    squares = np.zeros(data.weight.shape)
    at = sensitivity(model, x, ratios)
    for block in blocks(data.omega.size):
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


def unsure(J: Complex, weight: Array, common: Any, varied: Any) -> Complex:
    """(n_f, n_s, n_e, n) derivatives of which J^H J is what estimated weights cost.

    With V = D^-1 + c^2 1 1^T and own variances d = 1 / D that vary by (v d)^2, estimates by
    weights that vary have the covariance N^-1 + N^-1 Q N^-1, to second order, where
    Q = J^T V^-1 diag(V^-1) v^2 d^2 V^-1 J.

    Args:
        J: (n_f, n_s, n_e, n) of residuals that are white.
        weight: see `white`.
        common: see `white`.
        varied: (n_f, n_s, n_e) relative standard deviation of own variances.

    Source:
        Kackar and Harville, Approximations for standard errors of estimators of fixed and random
        effects in mixed linear models, J. Am. Stat. Assoc. 79 (1984) 853.
    """
    w, d = np.where(weight > 0, weight, 1.0), weight**2
    c = common**2
    own = 1 - c * d / (1 + c * d.sum(axis=1, keepdims=True))
    return white(J / w[..., None], weight, common) * (varied * np.sqrt(own))[..., None]


def white(log: Complex, weight: Array, common: Any) -> Complex:
    """(n_f, n_s, n_e, n) logarithms whose errors become independent and of the variance one.

    Errors have the covariance D^-1 + c^2 1 1^T over the sensors, D = weight^2. With s the
    sum of D and k = 1 - 1 / sqrt(1 + c^2 s), D^(1/2) (1 - k 1 1^T D / s) makes it the identity.

    Args:
        log: (n_f, n_s, n_e, n) logarithms.
        weight: (n_f, n_s, n_e) one over the errors of the sensors.
        common: (n_f, 1, n_e) or one error that they share.
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
