"""A family of bodies as a model with parameters: sums of small matrices, in its own modes.

All parameters are factors and enter by their logarithm. Rigid coordinates come first, then the
elastic ones of the family; what is held is eliminated.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import finite
from rom.body.flexible import FlexibleBody
from rom.body.records import still_motions
from rom.body.reference import marker_motion
from rom.eigen.supports import spring_matrices
from rom.errors import ConfigError, ParameterError
from rom.model import Array, Mask
from rom.names import named
from rom.parametric.family import BodyFamily
from rom.parametric.parameters import Density, Parameter, YoungsModulus
from rom.updating.models import ParametricModel

HELD_RTOL = 1e-9  # singular value of a motion that nothing holds
MASS_DOFS = 3  # translations, which a point mass resists


@dataclass(frozen=True, slots=True)
class GroundSpring:
    """A spring between an interface and the ground, unknown by a factor.

    Attributes:
        at: name of the interface.
        stiffness: (3,) translations, (6,) with rotations, or (6, 6) at a factor of one
            [N/m, N m/rad].
        low: smallest factor [1].
        high: largest factor [1].

    Raises:
        ConfigError: unless 0 < low <= high.
    """

    at: str
    stiffness: npt.ArrayLike
    low: float
    high: float

    def __post_init__(self) -> None:
        check_range(f"the spring at {self.at!r}", self.low, self.high)

    def term(self, body: FlexibleBody) -> tuple[Array, Array]:
        """Stiffness [N/m] and mass [kg] (6 + r, 6 + r) that it adds at a factor of one.

        Raises:
            ConfigError, InterfaceError: for a wrong stiffness or interface.
        """
        k = spring_matrices({self.at: self.stiffness}, body.markers, f"body {body.name!r}")
        H = motion_of(body, self.at)
        return H.T @ k[self.at] @ H, np.zeros((H.shape[1],) * 2)


@dataclass(frozen=True, slots=True)
class AddedMass:
    """A point mass on an interface, unknown by a factor.

    Attributes:
        at: name of the interface.
        mass: at a factor of one [kg].
        low: smallest factor [1].
        high: largest factor [1].

    Raises:
        ConfigError: unless 0 < low <= high and the mass is positive.
    """

    at: str
    mass: float
    low: float
    high: float

    def __post_init__(self) -> None:
        check_range(f"the mass at {self.at!r}", self.low, self.high)
        if not finite("mass", self.mass, ()) > 0:
            raise ConfigError(f"the mass at {self.at!r} is {self.mass} kg: it must be positive.")

    def term(self, body: FlexibleBody) -> tuple[Array, Array]:
        """Stiffness [N/m] and mass [kg] (6 + r, 6 + r) that it adds at a factor of one.

        Raises:
            InterfaceError: for a wrong interface.
        """
        H = motion_of(body, self.at)[:MASS_DOFS]
        return np.zeros((H.shape[1],) * 2), self.mass * H.T @ H


def check_range(what: str, low: float, high: float) -> None:
    """Refuse a range that is not one of positive factors.

    Raises:
        ConfigError: naming what has it.
    """
    if not 0 < finite("low", low, ()) <= finite("high", high, ()):
        raise ConfigError(f"{what} has the range {low} to {high}; factors are positive.")


def motion_of(body: FlexibleBody, name: str) -> Array:
    """(6, 6 + r) translation and rotation of an interface by rigid and elastic coordinates.

    Raises:
        InterfaceError: for a wrong interface.
    """
    return np.hstack(marker_motion(body.marker(name), body.n_modes))


@dataclass(frozen=True, slots=True)
class FamilyModel:
    """K = sum k_i(p) K_i, M = sum m_i(p) M_i of a family with what is attached to it.

    Attributes:
        K: (n_t, n, n) terms of the stiffness at factors of one.
        M: (n_t, n, n) terms of the mass.
        k_powers: (n_t, n_p) one where a parameter multiplies a term of the stiffness.
        m_powers: (n_t, n_p) likewise of the mass.
        seen: (n_s, n) rows of the sensors.
        driven: (n_e, n) rows of the inputs.
        names: of the parameters.
        low: (n_p,) smallest factors.
        high: (n_p,) largest factors.
        amount: (n_t,) one; zero for a candidate, which is not in the model but has derivatives.
        n_rigid: number of motions that nothing holds.
        motions: (6 + r, n) rigid and elastic coordinates of the family per coordinate here.
    """

    K: Array
    M: Array
    k_powers: Array
    m_powers: Array
    seen: Array
    driven: Array
    names: tuple[str, ...]
    low: Array
    high: Array
    amount: Array
    n_rigid: int
    motions: Array

    @property
    def present(self) -> Mask:
        """(n_p,) whether a parameter is part of the model: not a candidate."""
        n = len(self.names)
        absent = int(np.count_nonzero(self.amount == 0))
        return np.arange(n) < n - absent

    @property
    def n_elastic(self) -> int:
        """Number of its elastic modes."""
        return self.K.shape[1] - self.n_rigid

    def at(self, x: Array) -> ParametricModel:
        """The model at logarithms x (n_p,) of the factors, with the derivatives by them."""
        k, m = np.exp(self.k_powers @ x), np.exp(self.m_powers @ x)
        dK = np.tensordot(self.k_powers.T * k, self.K, 1)
        dM = np.tensordot(self.m_powers.T * m, self.M, 1)
        K, M = (np.tensordot(self.amount * c, A, 1) for c, A in ((k, self.K), (m, self.M)))
        return ParametricModel(K, M, dK, dM, self.seen, self.n_rigid)


def family_model(
    family: BodyFamily,
    rows: tuple[Array, Array],
    attached: Mapping[str, GroundSpring | AddedMass],
    candidates: Mapping[str, GroundSpring | AddedMass],
    fixed: Any,
) -> FamilyModel:
    """A family seen at sensors and driven at inputs.

    Args:
        family: without parameters of thickness.
        rows: (n_s, 6 + r) of the sensors and (n_e, 6 + r) of the inputs.
        attached: springs and masses with unknown factors, by name.
        candidates: springs and masses that may be missing; not part of the model.
        fixed: what is held, see `FlexibleBody.frequencies`.

    Raises:
        ConfigError: for a parameter of thickness, or a name that is taken.
        InterfaceError: if an interface is unknown.
    """
    if family.stretch is not None:
        raise ConfigError(
            "a family with a parameter of thickness cannot be updated.",
            hint="Reduce a family with moduli and densities alone.",
        )
    outside = {**attached, **candidates}
    if len(outside) < len(attached) + len(candidates) or set(outside) & set(family.parameters):
        raise ParameterError(f"one of {named(outside)} names two parameters.")
    pairs = [(*_term(family.body, share), share) for share in family.shares]
    added = [(*item.term(family.body), None) for item in outside.values()]
    K, M = (np.array([t[i] for t in pairs + added]) for i in (0, 1))
    N = _supported(family.body, fixed)
    known: dict[str, Any] = {**family.parameters, **outside}
    powers = _powers(family, tuple(outside))
    return FamilyModel(
        K=N.T @ K @ N,
        M=N.T @ M @ N,
        k_powers=powers[0],
        m_powers=powers[1],
        seen=rows[0] @ N,
        driven=rows[1] @ N,
        names=tuple(known),
        low=np.array([p.low for p in known.values()]),
        high=np.array([p.high for p in known.values()]),
        amount=np.repeat([1.0, 0.0], [len(K) - len(candidates), len(candidates)]),
        n_rigid=_count_free(family.body, attached, fixed),
        motions=N,
    )


def _term(body: FlexibleBody, share: Any) -> tuple[Array, Array]:
    names = share.integrals.__slots__
    part = replace(body, **{name: getattr(share.integrals, name) for name in names}, K=share.K)
    M, K = part.full_matrices()
    return K, M


def _powers(family: BodyFamily, attached: tuple[str, ...]) -> tuple[Array, Array]:
    """Which parameters multiply which terms."""
    n, n_p = len(family.shares), len(family.parameters)
    both = np.zeros((2, n + len(attached), n_p + len(attached)))
    for i, share in enumerate(family.shares):
        for j, p in enumerate(family.parameters.values()):
            both[0, i, j] = _acts(p, YoungsModulus, share.region)
            both[1, i, j] = _acts(p, Density, share.region) and not share.fixed
    own = np.arange(len(attached))
    both[:, n + own, n_p + own] = 1.0
    return both[0], both[1]


def _acts(parameter: Parameter, kind: type, region: str | None) -> bool:
    return isinstance(parameter, kind) and parameter.region in (None, region)


def _supported(body: FlexibleBody, fixed: Any) -> Array:
    """(6 + r, n) motions that keep what is held still."""
    body.check_support(fixed)
    if not fixed:
        return np.eye(6 + body.n_modes)
    return still_motions(body.held_rows(fixed))


def _count_free(body: FlexibleBody, attached: Mapping[str, Any], fixed: Any) -> int:
    """Number of rigid motions that neither supports nor springs hold."""
    scale = np.r_[np.ones(3), np.full(3, 1 / body.size)]
    stiff = [item.term(body)[0][:6, :6] for item in attached.values()]
    pulls = [k * np.outer(scale, scale) / max(np.abs(k).max(), 1e-300) for k in stiff]
    rows = np.vstack([np.zeros((1, 6)), body.held_rows(fixed)[:, :6] * scale, *pulls])
    return 6 - int(np.linalg.matrix_rank(rows, tol=HELD_RTOL))
