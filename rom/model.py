"""The records passed between the stages. Frozen, array-valued, without solvers."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import sqrt
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from rom.errors import MaterialError
from rom.notebook import shown
from rom.plausible import FOAM_SPEED, SOLID_DENSITY, STIFF_DENSITY, WAVE_SPEED, warn
from rom.units import SYSTEMS, UnitSystem, unit_system

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.integer[Any]]
Numbers = TypeVar("Numbers", Array, Index)


@dataclass(frozen=True, slots=True)
class Material:
    """Isotropic linear elastic solid.

    Attributes:
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        rho: density [kg/m^3].

    Raises:
        MaterialError: for E <= 0, rho <= 0, nu outside (-1, 0.5), or a number that is not finite.

    Warns:
        RomWarning: if sound would travel in it as in no solid: wrong units.
    """

    E: float
    nu: float
    rho: float

    def __post_init__(self) -> None:
        for name in ("E", "nu", "rho"):
            _check_number(name, getattr(self, name))
        _check_positive("E", self.E, "Pa")
        _check_positive("rho", self.rho, "kg/m^3")
        if not -1.0 < self.nu < 0.5:
            raise MaterialError(
                f"nu = {self.nu:g} is outside (-1, 0.5): the strain energy would be negative.",
                hint="Metals have 0.27 to 0.35.",
            )
        warn(self.doubt)

    @classmethod
    def from_units(cls, units: str, *, E: float, nu: float, rho: float) -> "Material":
        """The solid with numbers in another unit system, e.g. "mm-t-s": MPa and t/mm^3.

        Raises:
            ConfigError: if the unit system is unknown.
            MaterialError: as for numbers in SI.
        """
        unit = unit_system(units)
        for name, value in (("E", E), ("rho", rho)):
            _check_number(name, value)
        return cls(E * unit.pressure, nu, rho * unit.density)

    @property
    def doubt(self) -> str:
        """What is unusual about the numbers, in a sentence, or nothing."""
        return _solid_doubt(self)

    @property
    def stiffness(self) -> Array:
        """(6, 6) stiffness [Pa]; rows xx, yy, zz, yz, xz, xy with engineering shear strains."""
        mu, lam = (
            self.E / (2 * (1 + self.nu)),
            self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu)),
        )
        C = np.diag([2 * mu] * 3 + [mu] * 3)
        C[:3, :3] += lam
        return C

    @property
    def wave_speed(self) -> float:
        """Speed of a longitudinal wave in a thin bar [m/s]."""
        return sqrt(self.E / self.rho)


@dataclass(frozen=True, slots=True)
class Orthotropic:
    """Orthotropic linear elastic solid with principal axes 1, 2, 3.

    Attributes:
        E: (3,) Young's moduli E1, E2, E3 [Pa].
        nu: (3,) Poisson's ratios nu12, nu13, nu23; nu_ij = -eps_j / eps_i under stress along i.
        G: (3,) shear moduli G12, G13, G23 [Pa].
        rho: density [kg/m^3].
        axes: (3, 3) rows are the principal axes in the frame of the geometry.

    Raises:
        MaterialError: if the stiffness is not positive definite or the axes are not orthonormal.

    Warns:
        RomWarning: if sound would travel in it as in no solid: wrong units.
    """

    E: tuple[float, float, float]
    nu: tuple[float, float, float]
    G: tuple[float, float, float]
    rho: float
    axes: Any = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        for name in ("E", "nu", "G"):
            if np.shape(getattr(self, name)) != (3,):
                raise MaterialError(f"{name} needs three numbers, got {getattr(self, name)!r}.")
            for value in getattr(self, name):
                _check_number(name, value)
        for value in (*self.E, *self.G):
            _check_positive("E or G", value, "Pa")
        _check_number("rho", self.rho)
        _check_positive("rho", self.rho, "kg/m^3")
        axes = np.asarray(self.axes, dtype=float)
        if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3), atol=1e-9):
            raise MaterialError("axes is not a (3, 3) matrix of orthonormal rows.")
        lowest = np.linalg.eigvalsh(self._compliance()).min()
        if lowest <= 0:
            raise MaterialError(
                f"the orthotropic compliance has the negative eigenvalue {lowest:.3g} 1/Pa: "
                "some load would release energy.",
                hint="Check that |nu_ij| < sqrt(E_i / E_j).",
            )
        warn(self.doubt)

    @classmethod
    def from_units(
        cls, units: str, *, E: Any, nu: Any, G: Any, rho: float, axes: Any = None
    ) -> "Orthotropic":
        """The solid with numbers in another unit system, e.g. "mm-t-s": MPa and t/mm^3.

        Raises:
            ConfigError: if the unit system is unknown.
            MaterialError: as for numbers in SI.
        """
        unit = unit_system(units)
        for name, value in (("rho", rho), *(("E or G", x) for x in (*E, *G))):
            _check_number(name, value)
        moduli = (tuple(x * unit.pressure for x in values) for values in (E, G))
        turned = {} if axes is None else {"axes": axes}
        return cls(next(moduli), nu, next(moduli), rho * unit.density, **turned)

    @property
    def doubt(self) -> str:
        """What is unusual about the numbers, in a sentence, or nothing."""
        return _solid_doubt(self)

    def _compliance(self) -> Array:
        (E1, E2, E3), (n12, n13, n23), (G12, G13, G23) = self.E, self.nu, self.G
        C = np.diag([1 / E1, 1 / E2, 1 / E3, 1 / G23, 1 / G13, 1 / G12])
        C[0, 1] = C[1, 0] = -n12 / E1
        C[0, 2] = C[2, 0] = -n13 / E1
        C[1, 2] = C[2, 1] = -n23 / E2
        return C

    @property
    def stiffness(self) -> Array:
        """(6, 6) stiffness [Pa] in the geometry frame; order and shear as in `Material`."""
        T = _strain_rotation(np.asarray(self.axes, dtype=float))
        return T.T @ np.linalg.inv(self._compliance()) @ T

    @property
    def wave_speed(self) -> float:
        """Largest speed of a longitudinal wave in a thin bar [m/s]."""
        return sqrt(max(self.E) / self.rho)


def _solid_doubt(solid: Material | Orthotropic) -> str:
    """Speed of sound or density that no solid has, and the unit system that may be meant."""
    numbers = f"the solid with E = {solid.E}, rho = {solid.rho:g}"
    density = STIFF_DENSITY if solid.wave_speed > FOAM_SPEED else SOLID_DENSITY
    said = WAVE_SPEED.doubt(solid.wave_speed, numbers) or density.doubt(solid.rho, numbers)
    if not said:
        return ""
    meant = [name for name, unit in SYSTEMS.items() if _is_stiff(solid, unit)]
    kind = type(solid).__name__
    return f"{said} Units of {meant[0]}? {kind}.from_units({meant[0]!r}, …)." if meant else said


def _is_stiff(solid: Material | Orthotropic, unit: UnitSystem) -> bool:
    """Whether the numbers are those of a metal, mineral or wood in a unit system."""
    speed, rho = solid.wave_speed * unit.length / unit.time, solid.rho * unit.density
    return speed > FOAM_SPEED and not (WAVE_SPEED.doubt(speed) or STIFF_DENSITY.doubt(rho))


PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  # xx yy zz yz xz xy


def _strain_rotation(Q: Array) -> Array:
    """(6, 6) map of engineering strains from the geometry frame to the axes in the rows of Q."""
    T = np.empty((6, 6))
    for row, (i, j) in enumerate(PAIRS):
        for column, (k, m) in enumerate(PAIRS):
            value = Q[i, k] * Q[j, m] + (Q[i, m] * Q[j, k] if k != m else 0.0)
            T[row, column] = value * (1.0 if i == j else 2.0) / (1.0 if k == m else 2.0)
    return T


def _check_number(name: str, value: Any) -> None:
    number = np.isscalar(value) and not isinstance(value, bool | str)
    if not (number and np.isfinite(value)):
        raise MaterialError(f"{name} = {value!r} is not a finite number.")


def _check_positive(name: str, value: float, unit: str) -> None:
    if value <= 0:
        raise MaterialError(f"{name} = {value:g} {unit} must be positive.")


@dataclass(frozen=True, slots=True)
class Interface:
    """Nodes through which a body touches the rest of the mechanism.

    Attributes:
        name: name of the gmsh physical surface.
        nodes: (k,) node numbers, rows of ``FEModel.points``; ordered by coordinates, so that the
            order does not depend on the partition.
        points: (k, 3) coordinates of the nodes [m].
        surface_mass: (k, k) sparse matrix of the integrals of N_i N_j over the surface [m^2].
        origin: (3,) reference point in the body frame [m]: the centroid of the surface, or the
            point chosen by the user.
    """

    name: str
    nodes: Index
    points: Array
    surface_mass: Any
    origin: Array

    @property
    def dofs(self) -> Index:
        """(3k,) dof numbers, node by node: ``3*node + axis``."""
        return (3 * self.nodes[:, None] + np.arange(3)).ravel()

    @property
    def area(self) -> float:
        """Area of the surface [m^2]."""
        return float(self.surface_mass.sum())


@dataclass(frozen=True, slots=True)
class Attachment:
    """A rigid body, or a point mass, carried by an interface.

    The carrier follows the area-weighted mean motion of the interface, so that it adds inertia
    and no stiffness.

    Attributes:
        interface: name of the interface that carries it.
        mass: mass [kg].
        inertia: (3, 3) inertia about its mass centre, axes of the geometry [kg m^2].
        at: (3,) its mass centre [m]; None for the origin of the interface.
    """

    interface: str
    mass: float
    inertia: Any = ((0.0,) * 3,) * 3
    at: Any = None


@dataclass(frozen=True, slots=True)
class Region:
    """What one region adds to the matrices of a model.

    Attributes:
        K: (n, n) stiffness of its elements alone [N/m], with the layout of the model's.
        M: (n, n) mass of its elements alone [kg].
        stresses: evaluates the stress that its elements alone carry; None without finite elements.
        stretched: axis (0, 1, 2) -> `Layered`, for parameters of thickness; None when not known.
    """

    K: Any
    M: Any
    stresses: Any = None
    stretched: "Callable[[int], Layered] | None" = None


@dataclass(frozen=True, slots=True)
class Layered:
    """A region stretched by t along an axis: K(t) = t K_along + K_mixed + K_across / t.

    Attributes:
        layers: (low, high) of its elements along the axis [m], ascending, without overlap.
        K_along: (n, n) strains from derivatives along the layer alone [N/m].
        K_mixed: (n, n) these with strains from derivatives along the axis.
        K_across: (n, n) the latter alone.
    """

    layers: tuple[tuple[float, float], ...]
    K_along: Any
    K_mixed: Any
    K_across: Any


@dataclass(frozen=True)
class FEModel:
    """Linear finite element model of one free body, no boundary condition applied.

    Attributes:
        K: (n, n) stiffness [N/m], symmetric, with the six rigid motions in its null space;
            SciPy sparse, or a PETSc matrix distributed over the ranks.
        M: (n, n) mass [kg], symmetric positive definite; of the mesh alone when ``attachments``
            are given.
        points: (n/3, 3) reference coordinates in the body frame [m], the same on all ranks; dof
            ``3*i + a`` is axis a of node i.
        interfaces: interfaces by name.
        attachments: point masses and rigid bodies carried by interfaces.
        surface: outer surface for pictures; None when there is none.
        provenance: how the model was made: geometry file, parameters, material, versions.
        operators: the five verbs on this model when K and M are not SciPy matrices.
        stresses: evaluates stress of displacements, `rom.fe.stress.Stresses`; None for a model
            without finite elements.
        regions: {name: share of the region}, for parameters; empty when they are not known.
    """

    K: Any
    M: Any
    points: Array
    interfaces: dict[str, Interface] = field(default_factory=dict)
    attachments: tuple[Attachment, ...] = ()
    surface: "SurfaceMesh | None" = None
    provenance: dict[str, Any] = field(default_factory=dict)
    operators: Any = None
    stresses: Any = None
    regions: Mapping[str, "Region"] = field(default_factory=dict)

    @property
    def n_dofs(self) -> int:
        """Number of displacement dofs of the whole model."""
        return 3 * self.points.shape[0]

    @property
    def interface_names(self) -> tuple[str, ...]:
        """Names of the interfaces."""
        return tuple(self.interfaces)

    def mass(self) -> float:
        """Total mass with attachments [kg]; under mpirun to be called on all ranks."""
        carried = sum(a.mass for a in self.attachments)
        if self.operators is None:
            return float(self.M[::3][:, ::3].sum()) + carried
        along_x = np.zeros((self.operators.n_local, 1))
        along_x[::3] = 1.0
        return self.operators.gram(along_x, self.operators.apply_M(along_x)).item() + carried


@dataclass(frozen=True, slots=True)
class SurfaceMesh:
    """Triangles of the outer surface, for pictures.

    Attributes:
        nodes: (s,) node numbers, rows of ``FEModel.points``, ordered by coordinates.
        triangles: (t, 3) corners, as positions in ``nodes``; seen from outside counter-clockwise
            where the mesh tells.
    """

    nodes: Index
    triangles: Index


@dataclass(frozen=True, slots=True)
class Basis:
    """Columns that span the deformations kept.

    Attributes:
        Psi: (n, r) displacement shapes, interface columns first; under mpirun the rows of this
            rank.
        omega: (m,) circular frequencies [rad/s] of the last m columns, ascending.
        labels: (r,) what each column is, e.g. "constraint 12" or "fixed-interface 3".
    """

    Psi: Array
    omega: Array
    labels: tuple[str, ...]

    def project(self, A: Any) -> Array:
        """(r, r) symmetric projection Psi^T A Psi; on one process."""
        B = self.Psi.T @ (A @ self.Psi)
        return 0.5 * (B + B.T)


@dataclass(frozen=True, slots=True)
class Modes:
    """Natural modes, lowest first, mass-normalised; ``omega, shapes = modes`` unpacks them.

    Attributes:
        omega: (m,) circular frequencies [rad/s]; rigid motions are exactly zero.
        shapes: (n, m) shapes: displacements of a model, largest entry positive, under mpirun the
            rows of this rank; (6 + r, m) coordinates of a body; {name: (6 + r, m)} of the bodies
            of an assembly; whatever coordinates the maker of the modes names.
        residual: (m,) relative residual norm(K phi - lambda M phi) / norm(K phi); None where the
            modes are those of small matrices, solved to round-off.
    """

    omega: Array
    shapes: Any
    residual: Any = None

    @property
    def frequencies(self) -> Array:
        """(m,) natural frequencies [Hz]."""
        return self.omega / (2 * np.pi)

    def __iter__(self) -> Iterator[Any]:
        return iter((self.omega, self.shapes))

    def __getitem__(self, k: int) -> Any:
        return (self.omega, self.shapes)[k]

    def __repr__(self) -> str:
        return f"Modes({self._said})"

    @property
    def _said(self) -> str:
        if not self.omega.size:
            return "none"
        f = self.frequencies
        return f"{f.size} modes, {f[0]:.5g} to {f[-1]:.5g} Hz"

    def _repr_html_(self) -> str:
        columns, names = [self.frequencies], ["frequency [Hz]"]
        if self.residual is not None:
            columns, names = [*columns, self.residual], [*names, "residual"]
        rows = zip(range(1, self.omega.size + 1), *columns, strict=True)
        return shown(f"Modes: {self._said}", ("mode", *names), rows)


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a report: a quantity, its value, its limit, and whether it holds."""

    quantity: str
    value: float
    limit: str
    ok: bool


@dataclass(frozen=True, slots=True)
class Report:
    """Outcome of a set of checks; prints as a table.

    Attributes:
        title: what was checked.
        rows: the lines, in the order checked.
    """

    title: str
    rows: tuple[Row, ...] = ()

    @property
    def ok(self) -> bool:
        """True when every row holds."""
        return all(row.ok for row in self.rows)

    @property
    def failures(self) -> tuple[Row, ...]:
        """The rows that do not hold."""
        return tuple(row for row in self.rows if not row.ok)

    def __str__(self) -> str:
        width = max((len(row.quantity) for row in self.rows), default=0)
        lines = [
            f"  {row.quantity:<{width}}  {row.value:>12.5g}  {row.limit:<16}  "
            + ("ok" if row.ok else "FAILED")
            for row in self.rows
        ]
        return "\n".join([f"{self.title}: {self._verdict}", *lines])

    def __repr__(self) -> str:
        return f"Report({self.title!r}: {self._verdict})"

    @property
    def _verdict(self) -> str:
        return "ok" if self.ok else f"{len(self.failures)} of {len(self.rows)} failed"

    def _repr_html_(self) -> str:
        ordered = (*self.failures, *(row for row in self.rows if row.ok))
        rows = ((r.quantity, r.value, r.limit, "ok" if r.ok else "FAILED") for r in ordered)
        return shown(f"{self.title}: {self._verdict}", ("quantity", "value", "limit", ""), rows)
