"""A family of bodies as a model with parameters: sums of small matrices, in its own modes.

A body, or an assembly of bodies, is a family without parameters.

All parameters are factors and enter by their logarithm. Rigid coordinates come first, then the
elastic ones of the family; what is held is eliminated.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from rom.arguments import Positive, one_each, typed
from rom.assembly.assembly import Assembly
from rom.body.flexible import FlexibleBody
from rom.body.records import Marker, still_motions
from rom.body.recovery import StressRecovery
from rom.body.reference import marker_motion
from rom.components.families.assembled import FamilyAssembly
from rom.components.families.family import BodyFamily
from rom.components.families.parameters import Density, YoungsModulus
from rom.components.updating.models import Modal, ParametricModel, modal
from rom.eigen.supports import Fixed, spring_matrices
from rom.errors import ConfigError, ParameterError
from rom.model import Array, Index, Mask, moved_rigidly
from rom.names import check_known, named

BAND_RATIO = 1.5  # modes up to here, over the highest line, have damping that lines can see
HELD_RTOL = 1e-9  # singular value of a motion that nothing holds
MASS_DOFS = 3  # translations, which a point mass resists
Family = BodyFamily | FamilyAssembly
Structure = Family | FlexibleBody | Assembly
Place = str | tuple[str, str]  # interface of a body alone; body and interface of an assembly
Held = Fixed | tuple[Place, ...]
Factor = Annotated[float, Positive()]


@dataclass(frozen=True, slots=True)
class Parts:
    """The families of a structure, whose rigid and elastic coordinates stand one after another."""

    bodies: dict[str, FlexibleBody]  # at the centre of the ranges; one alone has no name

    @staticmethod
    def of(structure: "Structure | Parts") -> "Parts":
        """Those of an assembly, or of a body alone."""
        if isinstance(structure, Parts):
            return structure
        each = parts_of(structure).items()
        return Parts({k: one if isinstance(one, FlexibleBody) else one.body for k, one in each})

    @property
    def columns(self) -> dict[str, slice]:
        """Where the coordinates of each body stand."""
        found, first = {}, 0
        for name, body in self.bodies.items():
            found[name] = slice(first, first := first + 6 + body.n_modes)
        return found

    @property
    def n(self) -> int:
        """Number of all coordinates."""
        return sum(6 + body.n_modes for body in self.bodies.values())

    def rigid(self) -> tuple[Index, Array]:
        """(6 n_b,) numbers of the rigid coordinates, and their sizes where points move by one."""
        size = max(body.size for body in self.bodies.values())
        first = [columns.start + np.arange(6) for columns in self.columns.values()]
        return np.concatenate(first), np.tile(np.r_[np.ones(3), np.full(3, 1 / size)], len(first))

    def marker(self, place: Place) -> tuple[str, Marker]:
        """Name of the body and its interface."""
        if "" in self.bodies:
            return "", self.bodies[""].marker(str(place))
        body, interface = place if isinstance(place, tuple) and len(place) == 2 else ("", "")
        check_known(body, self.bodies, f"{place!r} must be (body, interface) of")
        return body, self.bodies[body].marker(interface)

    def motion(self, place: Place) -> Array:
        """(6, n) translation and rotation of an interface by all coordinates."""
        body, marker = self.marker(place)
        H = np.zeros((6, self.n))
        H[:, self.columns[body]] = np.hstack(marker_motion(marker, self.bodies[body].n_modes))
        return H


def parts_of(structure: Structure) -> Mapping[str, BodyFamily | FlexibleBody]:
    """{name: family or body} of an assembly; of one alone, without a name."""
    if isinstance(structure, BodyFamily | FlexibleBody):
        return {"": structure}
    return structure.families if isinstance(structure, FamilyAssembly) else structure.bodies


def terms_of(structure: Structure) -> list[tuple[str, FlexibleBody]]:
    """For each term of a sum its body by name, with the mass, stiffness and stress of the term."""
    found = []
    for name, one in parts_of(structure).items():
        if isinstance(one, FlexibleBody):
            found.append((name, one))
            continue
        for share in one.shares:
            mass = {key: getattr(share.integrals, key) for key in share.integrals.__slots__}
            stress = one.body.stress
            if isinstance(stress, StressRecovery):
                own = np.zeros_like(stress.operator) if share.stress is None else share.stress
                stress = StressRecovery(stress.points, own)
            found.append((name, replace(one.body, **mass, K=share.K, stress=stress)))
    return found


class UnknownPart(ABC):
    """What is attached to a structure, its stiffness or mass unknown by a factor.

    Attributes:
        low, high: smallest and largest factor [1].

    Raises:
        ConfigError: unless 0 < low <= high and the mass is positive.
    """

    __slots__ = ()
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ConfigError(f"{self} has the range {self.low} to {self.high}; it must ascend.")

    def term(self, structure: FlexibleBody | Parts) -> tuple[Array, Array]:
        """Stiffness [N/m] and mass [kg] (n, n) that it adds to a body at a factor of one.

        Raises:
            ConfigError, InterfaceError: for a wrong stiffness, body or interface.
        """
        parts = Parts.of(structure)
        H, k = self._acts(parts)
        added, nothing = H.T @ k @ H, np.zeros((parts.n,) * 2)
        return (nothing, added) if isinstance(self, AddedMass) else (added, nothing)

    @abstractmethod
    def _acts(self, parts: Parts) -> tuple[Array, Array]:
        """Motion (d, n) by all coordinates, and the stiffness or mass (d, d) it meets."""


@typed
@dataclass(frozen=True, slots=True)
class GroundSpring(UnknownPart):
    """A spring between an interface and the ground, unknown by a factor.

    Attributes:
        at: name of the interface; (body, interface) of an assembly.
        stiffness: (3,) translations, (6,) with rotations, or (6, 6) at a factor of one
            [N/m, N m/rad].
    """

    at: Place
    stiffness: npt.ArrayLike
    low: Factor
    high: Factor

    def _acts(self, parts: Parts) -> tuple[Array, Array]:
        return parts.motion(self.at), _stiffness(self.at, self.stiffness)


@typed
@dataclass(frozen=True, slots=True)
class JointSpring(UnknownPart):
    """A spring between two interfaces of an assembly, unknown by a factor: a bolted joint.

    It acts where the first one is; the second one reaches there by a rigid arm.

    Attributes:
        one, other: (body, interface); or of several bolts that are alike ((body, interface), ...).
        stiffness: of each, as of `GroundSpring` [N/m, N m/rad].
    """

    one: tuple[str, str] | tuple[tuple[str, str], ...]
    other: tuple[str, str] | tuple[tuple[str, str], ...]
    stiffness: npt.ArrayLike
    low: Factor
    high: Factor

    def _acts(self, parts: Parts) -> tuple[Array, Array]:
        sides: list[Any] = [
            x if x and isinstance(x[0], tuple) else (x,) for x in (self.one, self.other)
        ]
        one_each("places of the other side", len(sides[1]), "places of one", len(sides[0]))
        motions = []
        for one, other in zip(*sides, strict=True):
            arm = moved_rigidly(parts.marker(one)[1].point - parts.marker(other)[1].point)
            motions.append(parts.motion(one) - arm @ parts.motion(other))
        k = _stiffness(sides[0][0], self.stiffness)
        return np.vstack(motions), block_diag(*[k] * len(motions))


@typed
@dataclass(frozen=True, slots=True)
class AddedMass(UnknownPart):
    """A point mass on an interface, unknown by a factor.

    Attributes:
        at: name of the interface; (body, interface) of an assembly.
        mass: at a factor of one [kg].
    """

    at: Place
    mass: Annotated[float, Positive("kg")]
    low: Factor
    high: Factor

    def _acts(self, parts: Parts) -> tuple[Array, Array]:
        return parts.motion(self.at)[:MASS_DOFS], self.mass * np.eye(MASS_DOFS)


def check_units(structure: Structure) -> None:
    """Refuse bodies in other units than those of what was measured."""
    if other := {body.units for body in Parts.of(structure).bodies.values()} - {"SI"}:
        raise ConfigError(f"the body is in {other.pop()}; use SI units, as body.in_units gives it.")


def check_prior(prior: Iterable[str], names: tuple[str, ...]) -> None:
    """Refuse a prior of parameters that there are not."""
    for name in prior:
        check_known(name, names, f"prior: no parameter {name!r}; there are", ParameterError)


def _stiffness(place: Place, stiffness: npt.ArrayLike) -> Array:
    """(6, 6) of a spring at a place."""
    return spring_matrices({str(place): stiffness}, (str(place),), "the structure")[str(place)]


Attached = Mapping[str, GroundSpring | JointSpring | AddedMass]


@dataclass(frozen=True, slots=True)
class FamilyModel:
    """K = sum k_i(p) K_i, M = sum m_i(p) M_i of a family with what is attached to it."""

    K: Array  # (n_t, n, n) terms of the stiffness at factors of one
    M: Array  # (n_t, n, n) terms of the mass
    k_powers: Array  # (n_t, n_p) one where a parameter multiplies a term of the stiffness
    m_powers: Array  # (n_t, n_p) likewise of the mass
    sensors: Array  # (n_s, n) rows that give the displacements
    driven: Array  # (n_e, n) rows of the inputs
    names: tuple[str, ...]  # of the parameters
    low: Array  # (n_p,) smallest factors
    high: Array  # (n_p,) largest factors
    amount: Array  # (n_t,) one; zero for a candidate, not in the model but with derivatives
    n_rigid: int  # number of motions that nothing holds
    motions: Array  # (n_q, n) rigid and elastic coordinates of all bodies per coordinate here

    @property
    def present(self) -> Mask:
        """(n_p,) whether a parameter is part of the model: not a candidate."""
        n = len(self.names)
        return np.arange(n) < n - np.count_nonzero(self.amount == 0)

    @property
    def n_elastic(self) -> int:
        """Number of its elastic modes."""
        return self.K.shape[1] - self.n_rigid

    @property
    def ends(self) -> tuple[Array, Array]:
        """(n_p,) smallest and largest logarithms of factors."""
        return np.log(self.low), np.log(self.high)

    def labels(self, m: int) -> tuple[str, ...]:
        """Names of the parameters and of m damping ratios."""
        return (*self.names, *(f"zeta {k + 1}" for k in range(m)))

    def at(self, x: Array) -> ParametricModel:
        """The model at logarithms x (n_p,) of the factors, with the derivatives by them."""
        K, dK = summed(self.K, self.k_powers, x, self.amount)
        M, dM = summed(self.M, self.m_powers, x, self.amount)
        return ParametricModel(K, M, dK, dM, self.sensors, self.n_rigid)

    def modal(self, here: ParametricModel, ratios: Array) -> Modal:
        """Modes of the model at some factors; the last damping ratio is that of all others too."""
        return modal(here, np.r_[ratios, np.full(self.n_elastic - ratios.size, ratios[-1])])

    def elastic(self, x: Array) -> Array:
        """(n_elastic,) eigenvalues [rad^2/s^2] at logarithms x (n_p,) of the factors."""
        return modal(self.at(x), ()).lam[self.n_rigid :]

    def n_ratios(self, x: Array, highest: float) -> int:
        """How many damping ratios lines up to the highest one [rad/s] see, and one for others."""
        lam = self.elastic(x)
        return min(int(np.count_nonzero(lam < (BAND_RATIO * highest) ** 2)) + 1, lam.size)

    def reduced(self, T: Array, free: Index | Mask, x: Array, sensors: Array) -> "FamilyModel":
        """The same in coordinates T (n, r), of parameters that stay free, others kept at x (n_p,).

        Rows of the sensors are given as (n_s, r).
        """
        kept = np.array(x)
        kept[free] = 0.0
        K = (T.T @ self.K @ T) * np.exp(self.k_powers @ kept)[:, None, None]
        M = (T.T @ self.M @ T) * np.exp(self.m_powers @ kept)[:, None, None]
        small = replace(self, K=K, M=M, sensors=sensors, driven=self.driven @ T)
        names = tuple(np.array(self.names)[free].tolist())
        k_powers, m_powers = self.k_powers[:, free], self.m_powers[:, free]
        small = replace(small, names=names, low=self.low[free], high=self.high[free])
        return replace(small, k_powers=k_powers, m_powers=m_powers, motions=self.motions @ T)


def summed(
    terms: Array, powers: Array, x: Array, amount: Array | float = 1.0
) -> tuple[Array, Array]:
    """A sum of terms (n_t, ...) with factors, and its derivatives (n_p, ...) by their logarithms.

    Powers are as of `FamilyModel`; derivatives have all terms, whatever their amount in the sum.
    """
    c = np.exp(powers @ x)
    return np.tensordot(amount * c, terms, 1), np.tensordot(powers.T * c, terms, 1)


def family_model(
    family: Structure,
    rows: tuple[Array, Array],
    attached: Attached,
    candidates: Attached,
    fixed: Held,
) -> FamilyModel:
    """A family, body or assembly seen at sensors and driven at inputs, see `rom.update`.

    Rows (n_s, n) of the sensors and (n_e, n) of the inputs are those by rigid and elastic
    coordinates of one body after another. Candidates are not part of the model.
    """
    parts = Parts.of(family)
    if any(isinstance(p, BodyFamily) and p.stretch is not None for p in parts_of(family).values()):
        text = "a family with a parameter of thickness cannot be updated"
        raise ConfigError(f"{text}; reduce a family with moduli and densities alone.")
    outside = {**attached, **candidates}
    own = {} if isinstance(family, FlexibleBody | Assembly) else family.parameters
    if len(outside) < len(attached) + len(candidates) or set(outside) & set(own):
        raise ParameterError(f"{named(outside)}: one names two parameters; use another name.")
    terms, columns = terms_of(family), parts.columns
    M, K = np.zeros((2, len(terms) + len(outside), parts.n, parts.n))
    for k, (name, term) in enumerate(terms):
        at = k, columns[name], columns[name]
        M[at], K[at] = term.full_matrices()
    for k, item in enumerate(outside.values(), len(terms)):
        K[k], M[k] = item.term(parts)
    held, known = _conditions(family, fixed), {**own, **outside}
    N = still_motions(held)
    powers = [_own_powers(one) for one in parts_of(family).values()] + [(np.eye(len(outside)),) * 2]
    k_powers, m_powers = (block_diag(*(pair[i] for pair in powers)) for i in (0, 1))
    return FamilyModel(
        K=N.T @ K @ N,
        M=N.T @ M @ N,
        k_powers=k_powers,
        m_powers=m_powers,
        sensors=rows[0] @ N,
        driven=rows[1] @ N,
        names=tuple(known),
        low=np.array([p.low for p in known.values()]),
        high=np.array([p.high for p in known.values()]),
        amount=np.repeat([1.0, 0.0], [len(K) - len(candidates), len(candidates)]),
        n_rigid=_count_free(parts, attached, held),
        motions=N,
    )


def _own_powers(family: BodyFamily | FlexibleBody) -> tuple[Array, Array]:
    """Which parameters multiply which terms of the stiffness and of the mass."""
    if isinstance(family, FlexibleBody):
        return (np.zeros((1, 0)),) * 2
    k, m = np.zeros((2, len(family.shares), len(family.parameters)))
    for i, share in enumerate(family.shares):
        for j, p in enumerate(family.parameters.values()):
            acts = p.region in (None, share.region)
            k[i, j] = acts and isinstance(p, YoungsModulus)
            m[i, j] = acts and isinstance(p, Density) and not share.fixed
    return k, m


def _conditions(family: Structure, fixed: Held) -> Array:
    """(c, n) coordinates that supports and couplings keep zero."""
    parts = Parts.of(family)
    if isinstance(family, FamilyAssembly | Assembly):
        places = tuple((body, marker.name) for body, marker in map(parts.marker, fixed))
        whole = family if isinstance(family, Assembly) else family.nominal
        return whole.conditions(places)
    body = parts.bodies[""]
    names = fixed if isinstance(fixed, Mapping) else tuple(map(str, fixed))
    body.check_support(names)
    return body.held_rows(names)


def _count_free(parts: Parts, attached: Attached, held: Array) -> int:
    """Number of rigid motions of all bodies that neither supports, couplings nor springs hold."""
    rigid, scale = parts.rigid()
    stiff = [item.term(parts)[0][np.ix_(rigid, rigid)] for item in attached.values()]
    pulls = [k * np.outer(scale, scale) / max(np.abs(k).max(), 1e-300) for k in stiff]
    rows = np.vstack([np.zeros((1, rigid.size)), held[:, rigid] * scale, *pulls])
    return int(rigid.size - np.linalg.matrix_rank(rows, tol=HELD_RTOL))
