"""Stress of heated solids and wheels, and the stiffness it adds.

The linear solid under its supports answers the free thermal strain alpha dT by the displacement u::

    K u = integral of C : (alpha dT I) : eps(v),   sigma = C : (eps(u) - alpha dT I)

and sigma adds the geometric stiffness K_geo, the integral of grad u^T sigma grad v, at all speeds.
A homogeneous solid that is free to expand has stress only where its temperature is no linear
function of place.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import block_diag, csr_matrix, identity

from rom.arguments import finite, number, typed
from rom.components.wheels.modes import real_form
from rom.components.wheels.prestress.steady_rotation import Solid
from rom.components.wheels.rotation import axial_pins, largest_ratio
from rom.components.wheels.sector import CyclicSector, Matrix, all_rows, stresses_of, workers_of
from rom.eigen.supports import Fixed, held_dofs
from rom.eigen.verbs import dofs_of, pins, rigid_motions
from rom.eigen.workers import Workers, held_solution
from rom.errors import ConfigError, ModelError
from rom.model import Array, FEModel, Index
from rom.names import check_known

Temperature = float | Mapping[str, float] | npt.ArrayLike | Callable[[Array], npt.ArrayLike]


@typed
@dataclass(frozen=True)
class Heat:
    """Free thermal expansion of a solid, alpha dT in all directions.

    Attributes:
        expansion: coefficient of linear expansion alpha [1/K], or {region: alpha}; regions left
            out do not expand.
        temperature: change of temperature since the solid was free of stress [K], negative where
            it cooled: one number, {region: number} with regions left out at zero, (n / 3,) numbers
            at the nodes of the model, or a function of points (k, 3) [m].

    Raises:
        ConfigError: if one of the two is missing.
    """

    expansion: float | Mapping[str, float] | None = None
    temperature: Temperature | None = None

    def __post_init__(self) -> None:
        for name, like in (("expansion", "12e-6 per kelvin, of steel"), ("temperature", "80 K")):
            if getattr(self, name) is None:
                raise ConfigError(f"heat needs its {name}, such as {like}.")

    def on(self, model: FEModel) -> tuple[dict[str, float], dict[str, float], Array]:
        """Expansion [1/K] and temperature [K] of each region; what nodes (n / 3,) add to this [K].

        Raises:
            ConfigError: if a region is unknown, numbers are not finite or do not fit the nodes.
        """
        names, cold = tuple(model.regions), np.zeros(len(model.points))
        alpha = _by_region("expansion", self.expansion, names)
        given = self.temperature
        if not callable(given) and (isinstance(given, Mapping) or np.ndim(given) == 0):
            return alpha, _by_region("temperature", given, names), cold
        values = given(model.points) if callable(given) else given
        values = finite("the temperature at the nodes", values, cold.shape)
        return alpha, dict.fromkeys(names, 0.0), values

    def largest_strain(self, model: FEModel) -> float:
        """Largest free expansion [1], of region and nodes together."""
        alpha, by_region, at_nodes = self.on(model)
        more = float(np.abs(at_nodes).max(initial=0.0))
        return max((abs(alpha[r]) * (abs(T) + more) for r, T in by_region.items()), default=0.0)

    def described(self, share: float) -> str:
        """A share [1] of the temperature, for messages."""
        given = self.temperature
        if not isinstance(given, Mapping) and not callable(given) and np.ndim(given) == 0:
            return f"a temperature change of {share * float(given):.5g} K"  # type: ignore[arg-type]
        return f"{share:.4g} times the temperature change given"


def _by_region(what: str, given: Any, names: tuple[str, ...]) -> dict[str, float]:
    table = dict(given) if isinstance(given, Mapping) else dict.fromkeys(names, given)
    for name, value in table.items():
        check_known(name, names, f"the {what} names the region {name!r}; the model has")
        number(f"the {what} of region {name!r}", value)
    return {name: float(table.get(name, 0.0)) for name in names}


LARGEST_STRAIN = 0.5  # of heat, far beyond what a linear solid can say


@typed
def heated(model: FEModel, heat: Heat, *, fixed: Fixed = ()) -> FEModel:
    """The model with the stiffness of its thermal stress, for `rom.modes` and `rom.reduce`.

    Good as long as the supports are those under which it was heated, the interfaces ``fixed``; a
    body heated without supports may move as it likes.

    Raises:
        ConfigError: if the model has no finite elements, or a region is unknown.
        InterfaceError: if an interface is unknown, or the supports leave a rigid motion.
        ModelError: if the solid buckles below this temperature; the message says where.

    Source:
        Initial stress by temperature and its geometric stiffness: Cook, Malkus, Plesha and
        Witt, Concepts and Applications of Finite Element Analysis (2002), chapters on thermal
        and stress stiffening; see docs/theory/rotating_solids.md.
    """
    solid, K, K_geo, held = _stressed(model, heat, fixed)
    _refuse_buckled([_loose(held, K, K_geo)], heat, workers_of(model))
    if fixed:
        K_geo = csr_matrix(K_geo + _carried_along(K_geo, held, rigid_motions(model.points)))
    operators = model.operators.varied((1.0, [(1.0, solid.layout(K_geo))]), (1.0, []))
    K_hot = csr_matrix(model.K + K_geo) if hasattr(model.K, "tocsr") else operators.K
    given = heat.temperature
    plain = isinstance(given, Mapping) or np.isscalar(given)
    note = {
        "expansion [1/K]": repr(heat.expansion),
        "temperature change [K]": repr(given) if plain else "a field",
        "held while heated": list(fixed),
    }
    return replace(model, K=K_hot, operators=operators, provenance=model.provenance | note)


@typed
def heated_sector(sector: CyclicSector, model: FEModel, heat: Heat) -> CyclicSector:
    """The sector with the stiffness of thermal stress, the same in all sectors.

    The sector is made from the model by `rom.CyclicSector.from_model`, with or without matrices of
    rotation.

    Raises:
        ConfigError: if the model has no finite elements, or a region is unknown.
        ModelError: if the wheel buckles below this temperature; the message says where.

    Source:
        See docs/theory/rotating_solids.md for heat and rotation of wheels.
    """
    solid = finite_solid(model, heat)
    _, K_geo = _thermal(solid, sector.harmonic(0), axial_pins(sector), sector.M, sector.workers)
    each = (_waves(sector, n, sector.K, K_geo) for n in sector.diameters)
    _refuse_buckled(each, heat, sector.workers)
    return replace(sector, K=csr_matrix(sector.K + K_geo))


@typed
def thermal_buckling(model: FEModel, heat: Heat, *, fixed: Fixed = ()) -> float:
    """Factor [1] on the temperature at which the solid buckles; infinite if it never does.

    The smallest positive tau with a singular K + tau K_geo, interfaces ``fixed`` held; cooling has
    another one. Where only strains beyond Hooke's law would make it singular, it never buckles.

    Raises:
        ConfigError, InterfaceError: see `heated`.

    Source:
        Linear buckling K + tau K_geo: Cook, Malkus, Plesha and Witt, Concepts and Applications
        of Finite Element Analysis (2002).
    """
    _, K, K_geo, held = _stressed(model, heat, fixed)
    factor = critical_factor(*_loose(held, K, K_geo))
    return factor if factor * heat.largest_strain(model) < LARGEST_STRAIN else np.inf


def finite_solid(model: FEModel, heat: Heat | None = None) -> Solid:
    """The solid in large motion, heated, see `rom.fe.forms.large_strain.FiniteStrain`."""
    solid = stresses_of(model).finite_strain()
    if heat is not None:
        solid.heat(*heat.on(model))
    return solid


def critical_factor(K: Matrix, K_geo: Matrix) -> float:
    """Smallest positive tau with a singular K + tau K_geo; infinite if there is none.

    K (n, n) is positive definite, K_geo (n, n) the symmetric geometric stiffness of a load.
    """
    most = largest_ratio(csr_matrix(-K_geo), K)
    return 1 / most if most > 0 else np.inf


def _stressed(
    model: FEModel, heat: Heat, fixed: Fixed
) -> tuple[Solid, csr_matrix, csr_matrix, Index]:
    """The solid, its stiffness, that of its thermal stress, and the dofs held."""
    solid = finite_solid(model, heat)
    held = held_dofs(model.interfaces, fixed) if fixed else _six_dofs(model.points)
    M = all_rows(model, model.M)
    K, K_geo = _thermal(solid, identity(model.n_dofs, format="csr"), held, M, workers_of(model))
    return solid, K, K_geo, held


def _thermal(
    solid: Solid, T: csr_matrix, held: Index, M: Matrix, workers: Workers
) -> tuple[csr_matrix, csr_matrix]:
    """Stiffness of the cold solid and of the stress of its heat, with u = T a."""
    at_rest = np.zeros(T.shape[0])
    solid.warm(0.0)
    K = solid.tangent(at_rest)
    solid.warm(1.0)
    expands = -(T.T @ solid.force(at_rest))
    u = T @ held_solution(workers, (T.T @ K @ T, T.T @ M @ T), held, expands)
    return K, solid.geometric(u)


def _loose(held: Index, *matrices: csr_matrix) -> tuple[csr_matrix, ...]:
    free = np.setdiff1d(np.arange(matrices[0].shape[0]), held)
    return tuple(A[free][:, free] for A in matrices)


def _six_dofs(points: Array) -> Index:
    """Six dofs that stop every rigid motion and carry nothing when stress balances itself."""
    nodes = np.unique(np.r_[points.argmin(axis=0), points.argmax(axis=0)])
    dofs = dofs_of(nodes)
    return dofs[pins(rigid_motions(points[nodes] - points.mean(axis=0)))]


def _carried_along(K_geo: csr_matrix, held: Index, R: Array) -> csr_matrix:
    """(n, n) stiffness of the held dofs alone that lets the supports turn with the body.

    Rotations R change the direction of stress, which the forces F = K_geo R of the supports
    would resist; with W^T R = I on six of their dofs, F is taken off by
    - F W^T - W F^T + W (F^T R) W^T. Supports that are held do not feel it.
    """
    six = held[pins(R[held])]
    F, W = np.zeros_like(R), np.zeros_like(R)
    F[held] = (K_geo @ R)[held]
    W[six] = np.linalg.inv(R[six]).T
    S = F.T @ R
    F, W = csr_matrix(F), csr_matrix(W)
    return csr_matrix(W @ csr_matrix(0.5 * (S + S.T)) @ W.T - F @ W.T - W @ F.T)


def _waves(sector: CyclicSector, diameter: int, *matrices: Matrix) -> tuple[csr_matrix, ...]:
    """Real matrices of the waves with some nodal diameters, motions of the whole wheel pinned."""
    T = sector.harmonic(diameter)
    rigid = sector.rigid(diameter)[sector.free]
    standing = sector.standing(diameter)
    R = np.hstack([rigid.real, rigid.imag])
    R = R if standing else real_form(csr_matrix(rigid)).toarray()
    T = T if standing else real_form(T)
    R = R[:, np.linalg.norm(R, axis=0) > 0]
    whole = (T.T @ (A if standing else block_diag([A, A], format="csr")) @ T for A in matrices)
    return _loose(pins(R), *(csr_matrix(0.5 * (A + A.T)) for A in whole))


def _refuse_buckled(parts: Iterable[tuple[csr_matrix, ...]], heat: Heat, workers: Workers) -> None:
    """Raise if a part of the solid has K + K_geo with negative eigenvalues, naming the worst."""
    shares = []
    for part in parts:
        factor = workers.factor(sum(part))
        if factor is None or not factor.definite:
            shares.append(critical_factor(*part))
    if shares:
        text = f"the heated solid buckles at {heat.described(min(shares))}"
        raise ModelError(f"{text}; hold it more loosely, or follow its shape with rom.spin_up.")
