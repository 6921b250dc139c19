"""Models with parameters, their modes, and what is measured of them.

Source:
    Condensation to the sensors: Guyan, Reduction of stiffness and mass matrices, AIAA J. 3
    (1965) 380.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.stats import chi2
from scipy.stats import f as f_ratio

from rom.arguments import Count, finite, one_each, typed
from rom.components.updating.frf_data import Complex, frac
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index, Mask, Row
from rom.reduction.bases.fixed_interface import craig_bampton
from rom.rows import row

RIGID_RTOL = 1e-4  # round-off of a rigid motion's eigenvalue, of the lowest elastic one
MAX_FALSE_REFUSAL = 1e-3  # probability that a row refuses a right model
MIN_SCALE = 1e-8  # variance of a scale that is worth a thought
N_BANDS = 8  # of lines, in which the misfit is looked for
MAX_UNLIKE = 0.5  # one less the median FRAC: more is another body
DEAD_RATIO = 1e-8  # of the largest response: below it, round-off of those who compute responses
RANK_RTOL = 1e-7  # singular value of dependent columns of a basis, of the largest one


@dataclass(frozen=True, slots=True)
class ParametricModel:
    """K(p) = K + sum p_i dK_i and M(p) = M + sum p_i dM_i, seen at sensors.

    Attributes:
        K: (n, n) stiffness at p = 0 [N/m].
        M: (n, n) mass at p = 0 [kg].
        dK: (n_p, n, n) what each parameter adds to K [N/m]; zeros where it does not.
        dM: (n_p, n, n) what each parameter adds to M [kg].
        sensors: (n_s, n) rows that give the measured displacements [1].
        n_rigid: number of rigid motions, 0 for a supported and 6 for a free structure.

    Raises:
        ConfigError: if the matrices do not fit each other.
    """

    K: Array
    M: Array
    dK: Array
    dM: Array
    sensors: Array
    n_rigid: int = 0

    def __post_init__(self) -> None:
        n, n_p = len(self.K), len(self.dK)
        shapes = (n, n), (n_p, n, n), (n_p, n, n), (None, n)
        for name, shape in zip(("M", "dK", "dM", "sensors"), shapes, strict=True):
            finite(name, getattr(self, name), shape)

    def at(self, p: ArrayLike) -> "ParametricModel":
        """The model with its origin at p (n_p,) [1].

        Raises:
            ConfigError: if p has another length.
        """
        p = finite("p", p, (len(self.dK),))
        K, M = (A + np.tensordot(p, dA, 1) for A, dA in ((self.K, self.dK), (self.M, self.dM)))
        return replace(self, K=K, M=M)

    def in_basis(self, T: Array) -> "ParametricModel":
        """The model reduced to u = T a, T (n, r) the same for all p [1]: fast, still parametric.

        Raises:
            ConfigError: if the matrices do not fit each other.
        """
        K, M, dK, dM = (T.T @ A @ T for A in (self.K, self.M, self.dK, self.dM))
        return ParametricModel(K, M, dK, dM, self.sensors @ T, self.n_rigid)


class SensorModel(Protocol):
    """A model whose sensors are dofs, with its origin where it is asked for."""

    @property
    def sensors(self) -> Array:
        """(n_s, n) rows that give the measured displacements [1]."""

    def at(self, p: Array) -> ParametricModel:
        """The model with its origin at p (n_p,) [1]."""


@dataclass(frozen=True, slots=True)
class AtSensors:
    """A parametric model condensed statically to its sensors, anew for each p.

    With T = [1; -K_oo^-1 K_os] the stiffness at the sensors has the derivative T^T dK T, and the
    mass also that of T. What is between the sensors follows them statically, so that frequencies
    are too high however good the data.

    Attributes:
        full: the model; its sensors are dofs.
    """

    full: "SensorModel"

    def at(self, p: ArrayLike) -> ParametricModel:
        """The condensed model with its origin at p (n_p,) [1] and the derivatives there.

        Raises:
            ConfigError, ModelError: if sensors are no dofs, or do not hold the structure.
        """
        model = self.full.at(np.asarray(p, dtype=float))
        s = sensor_dofs(model)
        o = np.setdiff1d(np.arange(len(model.K)), s)
        try:
            K_oo = cho_factor(model.K[np.ix_(o, o)])
        except LinAlgError as error:
            text = "held at its sensors it still moves; it needs more of them."
            raise ModelError(text) from error
        T = np.zeros((len(model.K), s.size))
        T[s], T[o] = np.eye(s.size), -cho_solve(K_oo, model.K[np.ix_(o, s)])
        dT = -np.array([cho_solve(K_oo, (dK @ T)[o]) for dK in model.dK])  # rows o; s do not move
        moved = np.swapaxes(dT, 1, 2) @ (model.M @ T)[o]
        small = model.in_basis(T)
        return replace(small, dM=small.dM + moved + np.swapaxes(moved, 1, 2))


Model = ParametricModel | AtSensors


@dataclass(frozen=True, slots=True)
class Measurement:
    """Measured receptances.

    Attributes:
        omega: (n_f,) circular frequencies [rad/s].
        H: (n_f, n_s, n_e) displacement at each sensor per unit force at each exciter [m/N].
        inputs: (n_e,) which sensors have an exciter.
        weights: (n_f, n_s, n_e), (n_f, 1, 1) or one number: how far to trust each value; zero for
            a sensor that symmetry keeps at rest, which has only round-off or noise to say.

    Raises:
        ConfigError: if these do not fit each other, or a channel is dead.
    """

    omega: Array
    H: Complex
    inputs: tuple[int, ...]
    weights: Array | float = 1.0

    def __post_init__(self) -> None:
        n = len(self.omega), len(self.inputs)
        if np.ndim(self.H) != 3 or self.H.shape[::2] != n:
            raise ConfigError(f"H is {np.shape(self.H)}, needed are {n[0]} lines, {n[1]} exciters.")
        if not np.isfinite(self.H).all() or not self.H.all():
            raise ConfigError("H is zero or not finite somewhere: a dead channel; leave it out.")
        if not set(self.inputs) <= set(range(self.H.shape[1])):
            raise ConfigError(f"inputs = {self.inputs} must be from 0 to {self.H.shape[1] - 1}.")
        w = np.shape(self.weights)
        if w not in ((), self.H.shape, (len(self.omega), 1, 1)):
            raise ConfigError(f"weights {w} must be one number, or of the shape {self.H.shape}.")
        level = np.abs(self.H).max(axis=0) / np.abs(self.H).max()
        trusted = np.broadcast_to(self.weights, self.H.shape).any(axis=0)
        for at in map(tuple, np.argwhere((level < DEAD_RATIO) & trusted)):  # the logarithm of noise
            raise ConfigError(
                f"under exciter {at[1]} sensor {at[0]} moves by {level[at]:.1e} of the largest "
                "response: a dead channel, kept at rest by symmetry or a support.",
                hint="Give it the weight 0 there, or leave it out.",
            )

    def check(self, model: "Model", zeta: ArrayLike = ()) -> None:
        """See that a model and damping ratios (m,) [1] can answer to it.

        Raises:
            ConfigError: if the sensors differ in number, or a ratio is not positive.
        """
        full = model.full if isinstance(model, AtSensors) else model
        one_each("sensors of the model", len(full.sensors), "of the test", self.H.shape[1])
        if not (np.asarray(zeta) > 0).all():
            raise ConfigError(f"zeta = {zeta!r}: damping ratios to start from must be positive.")


@dataclass(frozen=True, slots=True)
class Modal:
    """A model in its own modes: Z^-1 = Phi diag(g(omega)) Phi^T with modal damping.

    Attributes:
        lam: (n,) eigenvalues [rad^2/s^2].
        Phi: (n, n) modes, mass-normalised [kg^-1/2].
        d: (n,) damping 2 zeta omega [rad/s] of each mode.
    """

    lam: Array
    Phi: Array
    d: Array

    def g(self, omega: Array) -> Complex:
        """(n_f, n) receptance of each mode [s^2] at omega (n_f,) [rad/s]."""
        w = omega[:, None]
        return 1.0 / (self.lam - w**2 + 1j * w * self.d)


def modal(model: ParametricModel, zeta: ArrayLike) -> Modal:
    """Modes of a model at its origin; zeta (m,) [1] of the lowest elastic ones, others undamped.

    Raises:
        ConfigError, ModelError: for more ratios than modes; for mass or stiffness not positive.
    """
    try:
        lam, Phi = eigh(model.K, model.M)
    except LinAlgError as error:
        raise ModelError("the changes must leave a mass matrix that is positive.") from error
    elastic, rigid = lam[model.n_rigid :], np.abs(lam[: model.n_rigid]).max(initial=0.0)
    if rigid > RIGID_RTOL * np.abs(elastic).min(initial=np.inf):
        text = f"n_rigid = {model.n_rigid}, but a motion among them has the frequency"
        why = "the structure is held; take n_rigid of what is free."
        raise ModelError(f"{text} {np.sqrt(rigid):.4g} rad/s: {why}")
    lam[: model.n_rigid] = 0.0
    if not (elastic > 0).all():
        text = f"{model.n_rigid} rigid motions leave the eigenvalue {elastic.min():.3g} rad^2/s^2"
        raise ModelError(f"{text}: the stiffness must be positive.")
    zeta, d = np.asarray(zeta, dtype=float), np.zeros(lam.size)
    if zeta.size > (n := elastic.size):
        raise ConfigError(f"at most {n} damping ratios, of the elastic modes, got {zeta.size}.")
    damped = slice(model.n_rigid, model.n_rigid + zeta.size)
    d[damped] = 2 * zeta * np.sqrt(lam[damped])
    return Modal(lam, Phi, d)


def damping_matrix(model: ParametricModel, zeta: ArrayLike) -> Array:
    """(n, n) C = sum 2 zeta omega (M phi)(M phi)^T at the origin of the model [N s/m].

    Raises:
        ConfigError, ModelError: as `modal`.
    """
    modes = modal(model, zeta)
    return (model.M @ modes.Phi * modes.d) @ (model.M @ modes.Phi).T


@typed
def parametric_basis(
    model: ParametricModel, n_modes: Annotated[int, Count(1)], samples: ArrayLike
) -> Array:
    """(n, r) basis [1] for a range of p: Craig-Bampton at samples, held at the sensors.

    Each of the samples (k, n_p), relative changes [1], gives n_modes.

    Raises:
        ConfigError: if sensors are no dofs.
    """
    s = sensor_dofs(model)
    at = [model.at(p) for p in np.atleast_2d(np.asarray(samples, dtype=float))]
    Psi = np.hstack([craig_bampton(here.K, here.M, s, n_modes).Psi for here in at])
    U, size, _ = np.linalg.svd(Psi / np.linalg.norm(Psi, axis=0), full_matrices=False)
    return U[:, size > RANK_RTOL * size[0]]


def sensor_dofs(model: ParametricModel) -> Index:
    """(n_s,) the dofs that the sensors are, if they are such."""
    s = model.sensors.argmax(axis=1)
    if not np.array_equal(model.sensors, np.eye(len(model.K))[s]):
        raise ConfigError("the sensors must be dofs of the model; condense before reducing.")
    return s


def likeness(H: Complex, measured: Complex, used: Mask) -> Row:
    """One less the median FRAC of all pairs of channels (n_f, n_s, n_e), over lines that count."""
    seen = used.any(axis=0)  # of the others it is 0 / 0
    value = frac(*(np.where(used, x, 0.0)[:, seen, None] for x in (H, measured)))
    return row("one less the median FRAC", 1.0 - float(np.median(value)), MAX_UNLIKE)


def worst_rows(
    squares: Array, used: Mask, omega: Array, known: float = 1.0, scale: float = 0.0
) -> list[Row]:
    """Chi-square of the sensor and of the band of lines that deviate most, see `chi_row`.

    Of squared residuals (n_f, n_s, n_e), those used, at lines (n_f,) [rad/s].
    """
    blocks = np.array_split(np.arange(omega.size), min(N_BANDS, omega.size))
    f, rows = omega / (2 * np.pi), []
    sensors = [(f"worst sensor, {k}", np.s_[:, k]) for k in range(squares.shape[1])]
    bands = [(f"worst band, {f[b[0]]:.4g} to {f[b[-1]]:.4g} Hz", np.s_[b]) for b in blocks]
    for parts in (sensors, bands):
        found = [(name, squares[at].sum(), 2.0 * used[at].sum()) for name, at in parts]
        off = [(x[1] - x[2]) / np.sqrt(2 * x[2]) if x[2] else -np.inf for x in found]
        rows.append(chi_row(*found[int(np.argmax(off))], len(parts), known, scale))
    return rows


def chi_row(
    name: str, value: float, freedom: float, trials: int, known: float = 1.0, scale: float = 0.0
) -> Row:
    """Chi-square over its expectation; the limit is kept by a right model but for one in 1000.

    Squares over estimated variances vary more, as if only a known share of the freedom were theirs;
    the variance of a scale of all makes the quotient one of F, its denominator of freedom 2 / it.
    """
    freedom = max(freedom, 1.0)
    own = known * freedom
    limit = chi2.isf(MAX_FALSE_REFUSAL / trials, own) / own
    if scale > MIN_SCALE:
        limit = f_ratio.isf(MAX_FALSE_REFUSAL / trials, own, 2 / scale)
    return row(f"{name}, over its expectation", value / freedom, float(limit))
