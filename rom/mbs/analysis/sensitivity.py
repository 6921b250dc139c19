"""How results change with the parameters of a mechanism."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import positive, shortened, typed
from rom.errors import ConfigError, ModelError
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.linearize import Linearization, linearize
from rom.mbs.analysis.local_equations import Instant, instant
from rom.mbs.analysis.rotors.spins import AT_REST
from rom.mbs.analysis.tangent import Tangent
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import check_known

DIFFERENCE_STEP = 1e-4  # of a parameter, relative to its size
# steps that are tried where the result is a motion, and the relative error that ends the search
MAX_STEP, MAX_HALVINGS, ERROR_RTOL = 5e-2, 9, 1e-9
SEPARATE_RTOL = 1e-6  # distance of eigenvalues from which on each has its own derivative
Builder = Callable[..., Mechanism]
Output = Callable[[Mechanism, State], npt.ArrayLike]
Result = Callable[..., npt.ArrayLike]


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of a result.

    Attributes:
        names: the k parameters.
        value: (...) the result.
        derivative: (..., k) its derivatives, unit of the result per unit of the parameter.
        error: (k,) estimated error of the derivatives relative to their size [1]; zeros where they
            follow from equations at the solution.
    """

    names: tuple[str, ...]
    value: Array
    derivative: Array
    error: Array

    def __getitem__(self, name: str) -> Array:
        """(...) derivative by one parameter."""
        check_known(name, self.names, f"no parameter {name!r}; there are")
        return self.derivative[..., self.names.index(name)]


@typed
def equilibrium_sensitivity(
    build: Builder, parameters: Mapping[str, float], output: Output, **options: Any
) -> Sensitivity:
    """Derivatives of what an equilibrium at rest looks like, by the implicit function theorem.

    With r(q, lam, p) = 0 and the joints closed, Phi(q, p) = 0::

        [K  G^T] [dq/dp  ]     [dr/dp  ]
        [G   0 ] [dlam/dp] = - [dPhi/dp]

    No second equilibrium is sought. The right-hand side is a difference between two mechanisms in
    the same position.

    Args:
        build: function of the parameters by name that returns the mechanism, always with the same
            bodies and joints.
        parameters: {name: value}, each in its own unit.
        output: function of a mechanism and a state; returns a number or an array.
        options: of `equilibrium`.

    Raises:
        ConfigError: for wrong parameters, or mechanisms of different size.
        ModelError: if the equilibrium spins, or is not unique.
    """
    values = by_name(parameters, "build", build)
    mechanism, state = _rest(build, values, options)
    value = np.asarray(output(mechanism, state))
    if value.dtype.kind not in "iufc":
        raise ConfigError(f"output gives {shortened(value)}; a number or an array is needed.")
    slopes = [_slope(lambda mech, _, at: output(mech, at), build, values, k, state) for k in values]
    return _collected(values, value, slopes)


@typed
def frequency_sensitivity(
    build: Builder, parameters: Mapping[str, float], **options: Any
) -> Sensitivity:
    """Derivatives of the eigenvalues of small motions about an equilibrium at rest.

    With E(s) = [s^2 M + s C + K, G^T; G, 0], its right vector x and its left vector y::

        ds/dp = - y^H (dE/dp) x / y^H (dE/ds) x

    The matrices change with the parameter and with the equilibrium that moves with it.

    Args:
        build: as in `equilibrium_sensitivity`.
        parameters: {name: value}, each in its own unit.
        options: of `equilibrium`.

    Returns:
        ``value`` (f,) complex eigenvalues [rad/s] in the order of `linearize`: imaginary parts are
        2 pi times frequencies.

    Raises:
        ConfigError, ModelError: as `equilibrium_sensitivity`; ModelError for equal eigenvalues,
            which have no derivatives of their own.

    Source:
        Murthy and Haftka, Derivatives of eigenvalues and eigenvectors of a general complex matrix,
        Int. J. Numer. Meth. Engng. 26 (1988) 293.
    """
    values = by_name(parameters, "build", build)
    mechanism, state = _rest(build, values, options)
    now, linear = instant(mechanism, state.t), linearize(mechanism, state)
    here = _matrices(mechanism, now, state)
    triples = [_vectors(here, linear, k) for k in range(linear.eigenvalues.size)]
    slopes = []
    for name in values:
        change = _slope(_matrices, build, values, name, state)
        slopes.append(np.array([_rate(here, change, *triple) for triple in triples]))
    return _collected(values, linear.eigenvalues, slopes)


@typed
def motion_sensitivity(result: Result, parameters: Mapping[str, float]) -> Sensitivity:
    """Derivatives of the result of a simulation, by central differences with a chosen step.

    Steps are halved; the two results of each pair are combined to fourth order, and the pair that
    agrees best wins: round-off, and steps of the integration that jump, then do not spoil it.

    Args:
        result: function of the parameters by name that returns a number or an array, for example
            ``lambda length: rom.simulate(pendulum(length), ...).position("bob")[-1]``.
        parameters: {name: value}, each in its own unit.

    Raises:
        ConfigError: for wrong parameters, or results of different shape.

    Source:
        Ridders, Accurate computation of F'(x) and F'(x)F''(x), Adv. Eng. Software 4 (1982) 75.
    """
    values = by_name(parameters, "result", result)
    found = [_ridders(result, values, name) for name in values]
    value = np.asarray(result(**values), dtype=float)
    whole = _collected(values, value, [slope for slope, _ in found])
    return replace(whole, error=np.array([error for _, error in found]))


def by_name(
    parameters: Mapping[str, float], name: str, called: Callable[..., object]
) -> dict[str, float]:
    """The parameters, if there are some and a function takes them by name."""
    if not parameters:
        raise ConfigError(f"parameters = {parameters!r} must be {{name: value}}.")
    with suppress(ValueError):  # written in C, without a signature
        try:
            signature(called).bind(**parameters)
        except TypeError as error:
            text = f"{name} must take the parameters {sorted(parameters)} by name: {error}."
            raise ConfigError(text) from error
    return dict(parameters)


def _collected(values: dict[str, float], value: Array, slopes: list[Array]) -> Sensitivity:
    return Sensitivity(tuple(values), value, np.stack(slopes, axis=-1), np.zeros(len(slopes)))


def _rest(
    build: Builder, values: dict[str, float], options: dict[str, Any]
) -> tuple[Mechanism, State]:
    mechanism = build(**values)
    state = equilibrium(mechanism, **options)
    if state.v.any():
        raise ModelError("sensitivities need an equilibrium at rest; leave spin out.")
    return mechanism, state


def _slope(
    of: Callable[[Mechanism, Instant, State], npt.ArrayLike],
    build: Builder,
    values: dict[str, float],
    name: str,
    state: State,
) -> Array:
    """Total derivative by a parameter: between the equilibria one step of it before and after.

    They are there to first order, by the implicit function theorem.
    """
    step = DIFFERENCE_STEP * (abs(values[name]) or 1.0)
    sides = []
    for sign in (-1, 1):
        mechanism = build(**{**values, name: values[name] + sign * step})
        now = instant(mechanism, state.t)
        if (now.packed.q.size, now.W.value.size) != (state.q.size, state.lam.size):
            raise ConfigError(f"bodies and joints must be the same for another {name!r}.")
        now.W.base[:] = state.base
        sides.append((sign, mechanism, now))
    tangent = Tangent.of(instant(build(**values), state.t), state, AT_REST)
    forces = [now.residual(state.q, state.v, state.a, state.lam) for _, _, now in sides]
    gaps = [now.gradient(state.q, state.v)[0] for _, _, now in sides]
    force, gap = tangent.T.T @ (forces[1] - forces[0]) / 2, (gaps[1] - gaps[0]) / 2
    change = replace(tangent, r=force, gap=gap).balanced()
    ends = []
    for sign, mechanism, now in sides:
        q = now.shifted(state.q, sign * change[0])
        moved = replace(state, q=q, lam=state.lam + sign * change[1])
        ends.append(np.asarray(of(mechanism, now, moved)))
    return (ends[1] - ends[0]) / (2 * step)


def _matrices(_: Mechanism, now: Instant, state: State) -> Array:
    """(3, n + m, n + m) coefficients of s^2, s and 1 in E(s)."""
    M, C, K = now.matrices(state)
    G = now.gradient(state.q, state.v)[1]
    n, m = M.shape[0], G.shape[0]
    E = np.zeros((3, n + m, n + m))
    E[0, :n, :n], E[1, :n, :n], E[2, :n, :n] = M, C, K
    E[2, :n, n:], E[2, n:, :n] = G.T, G
    return E


def _vectors(E: Array, linear: Linearization, k: int) -> tuple[complex, Array, Array]:
    """Eigenvalue k with its right and left vector."""
    s, every = linear.eigenvalues[k], linear.eigenvalues
    near = np.abs(np.delete(every, k) - s).min(initial=np.inf)
    if near < SEPARATE_RTOL * np.abs(every).max():
        text = f"two eigenvalues are equal ({abs(s):.6g} rad/s): neither has a derivative"
        raise ModelError(f"{text}; let the parameters break the symmetry a little.")
    n = linear.basis.shape[0]
    full = (np.array([s**2, s, 1.0]) @ E.reshape(3, -1)).reshape(E.shape[1:])
    U, _, V = np.linalg.svd(s**2 * linear.M + s * linear.C + linear.K)
    right, left = linear.basis @ V[-1].conj(), linear.test @ U[:, -1]
    A, block = full[n:, :n], full[:n, :n]
    above = np.linalg.lstsq(A.T, -block @ right, rcond=1e-9)[0]
    below = np.linalg.lstsq(A.T, -block.conj().T @ left, rcond=1e-9)[0]
    return s, np.concatenate([right, above]), np.concatenate([left, below])


def _rate(E: Array, change: Array, s: complex, x: Array, y: Array) -> complex:
    """Derivative of an eigenvalue."""
    projected_change = y.conj() @ (s**2 * change[0] + s * change[1] + change[2]) @ x
    return -projected_change / (y.conj() @ (2 * s * E[0] + E[1]) @ x)


def _ridders(result: Result, values: dict[str, float], name: str) -> tuple[Array, float]:
    """Derivative by one parameter, and its estimated relative error."""
    step = positive("step", MAX_STEP * (abs(values[name]) or 1.0))
    best, error, last, before = np.zeros(0), np.inf, None, None
    for _ in range(MAX_HALVINGS):
        ends = [np.asarray(result(**{**values, name: values[name] + x})) for x in (-step, step)]
        if ends[0].shape != ends[1].shape:
            raise ConfigError(f"the result must have the same shape for another {name!r}.")
        slope = (ends[1] - ends[0]) / (2 * step)
        if last is not None:
            better = slope + (slope - last) / 3
            size = max(float(np.abs(better).max(initial=0.0)), 1e-300)
            if before is not None:
                miss = float(np.abs(better - before).max(initial=0.0)) / size
                if miss < error:
                    best, error = better, miss
                if error < ERROR_RTOL or miss > 10 * error:
                    break
            before = better
        last, step = slope, step / 2
    return best, error
