"""The records passed between the stages. Frozen, array-valued, without solvers."""

import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar
from weakref import WeakSet

import numpy as np
import numpy.typing as npt

from rom.arguments import Number, Point, matrix, typed
from rom.errors import InterfaceError, ModelError, warn
from rom.material import PAIRS as PAIRS
from rom.material import Material as Material
from rom.material import Orthotropic as Orthotropic
from rom.names import check_text, named
from rom.notebook import html_table, listed

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.integer[Any]]
Numbers = TypeVar("Numbers", Array, Index)
BUCKLING_LOADS = "buckling loads"  # in the provenance of a body, see `rom.body.prestress`
FILE_FRAME = "as in its file"  # the reference condition of a body from another program
OWN_FRAME = "frame of the body"  # the marker that is the frame a body was given in


@typed
@dataclass(frozen=True, slots=True)
class Rotations:
    """Dofs that turn a node, of beams and shells; each about one axis.

    Attributes:
        nodes: (t,) which node each turns: its row in the points of what has these rotations.
        axes: (t, 3) unit vectors in the body frame, orthogonal for one node.
        dofs: (t,) their numbers, behind those of all displacements.
    """

    nodes: Index
    axes: Array
    dofs: Index

    def of(self, nodes: Index) -> "Rotations | None":
        """Those of some nodes (k,), counted there; None where none of these turns."""
        order = np.argsort(nodes)
        place = order[np.searchsorted(nodes, self.nodes, sorter=order) % nodes.size]
        here = np.flatnonzero(nodes[place] == self.nodes)
        here = here[np.argsort(place[here], kind="stable")]
        return Rotations(place[here], self.axes[here], self.dofs[here]) if here.size else None


def moved_rigidly(x: Array) -> Array:
    """(6, 6) displacement and rotation at a point (3,) of a rigid body by those at zero."""
    return np.vstack([rigid_motions(np.reshape(x, (1, 3))), np.eye(6)[3:]])


def rigid_motions(points: Array, rotations: Rotations | None = None, n: int | None = None) -> Array:
    """(n, 6) motions of points (k, 3) [m]: unit translations [1], rotations about zero [m].

    The first 3 k rows are theirs, those of their rotations come next; the rest has no place.
    """
    R = np.zeros((points.size if n is None else n, 6))
    moved = R[: points.size].reshape(-1, 3, 6)
    moved[:, :, :3] = np.eye(3)
    x, y, z = points.T
    moved[:, 1, 3], moved[:, 2, 3] = -z, y
    moved[:, 0, 4], moved[:, 2, 4] = z, -x
    moved[:, 0, 5], moved[:, 1, 5] = -y, x
    if rotations is not None:
        R[points.size : points.size + len(rotations.axes), 3:] = rotations.axes
    return R


@typed
@dataclass(frozen=True, slots=True)
class Interface:
    """Nodes through which a body touches the rest of the mechanism.

    Attributes:
        name: name of the gmsh physical surface, a text of one line, see `rom.names`.
        nodes: (k,) node numbers, rows of ``FEModel.points``; ordered by coordinates, so that the
            order does not depend on the partition.
        points: (k, 3) coordinates of the nodes [m].
        surface_mass: (k, k) sparse matrix of the integrals of N_i N_j over the surface [m^2].
        origin: (3,) reference point in the body frame [m]: on the axis, in the middle of the faces,
            where the geometry knows them as cylinders; else the centroid of the surface, or the
            point chosen by the user.
        axis: (3,) unit direction of the axis of such cylinders; None for other surfaces.
        rotations: those of its nodes; None for solids.
    """

    name: str
    nodes: Index
    points: Array
    surface_mass: Any
    origin: Array
    axis: Array | None = None
    rotations: Rotations | None = None

    def __post_init__(self) -> None:
        check_text(self.name, "an interface", InterfaceError)

    def __repr__(self) -> str:
        origin = ", ".join(f"{x:.5g}" for x in self.origin)
        return f"Interface({self.name!r}: {self.nodes.size} nodes, origin ({origin}) m)"

    @property
    def dofs(self) -> Index:
        """(3k + t,) dof numbers, node by node: ``3*node + axis``; then those of the rotations."""
        displacements = (3 * self.nodes[:, None] + np.arange(3)).ravel()
        return (
            displacements if self.rotations is None else np.r_[displacements, self.rotations.dofs]
        )

    def rigid_motions(self, about: Point = (0.0, 0.0, 0.0)) -> Array:
        """(3k + t, 6) motions of its dofs while it is rigid, turning about a point (3,) [1, m]."""
        return rigid_motions(self.points - np.asarray(about), self.rotations, self.dofs.size)

    @property
    def area(self) -> float:
        """Area of the surface [m^2]."""
        return float(self.surface_mass.sum())


@typed
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
    mass: Annotated[float, Number("kg")]
    inertia: Annotated[npt.ArrayLike, Number("kg m^2", (3, 3))] = ((0.0,) * 3,) * 3
    at: Point | None = None


@typed
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


@typed
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


@typed
@dataclass(frozen=True)
class FEModel:
    """Linear finite element model of one free body, no boundary condition applied.

    The first 3 k dofs displace its k nodes, dof ``3*i + a`` node i along axis a. Rotations of
    nodes come next, and last coordinates without a place, as those of modes in superelements.

    Attributes:
        K: (n, n) stiffness [N/m], symmetric, with the six rigid motions in its null space, with
            that of ``springs``; SciPy sparse, or a PETSc matrix distributed over the ranks.
        M: (n, n) mass [kg], symmetric, positive definite but for rotations without inertia; of
            the mesh alone when ``attachments`` are given.
        points: (k, 3) reference coordinates in the body frame [m], the same on all ranks.
        interfaces: interfaces by name.
        attachments: point masses and rigid bodies carried by interfaces.
        kinds: {interface: its kind} of those that the model ties by itself, as rigid elements of
            a deck do; where nobody names another kind.
        surface: outer surface for pictures; None when there is none.
        provenance: how the model was made: geometry file, parameters, material, versions.
        operators: the five verbs on this model when K and M are not SciPy matrices.
        stresses: evaluates stress of displacements, `rom.fe.forms.stress.Stresses`; None for a
            model without finite elements.
        regions: {name: share of the region}, for parameters; empty when they are not known.
        rotations: which dofs turn nodes; None for solids.
        n_scalars: number of coordinates without a place.
        D: (n, n) damping [N s/m] of the deformation, which bodies get; None for none.
        springs: names of those of a deck that the stiffness has beside that of elements.
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
    rotations: Rotations | None = None
    n_scalars: int = 0
    D: Any = None
    kinds: Mapping[str, str] = field(default_factory=dict)
    springs: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return (
            f"FEModel({self.n_dofs} dofs, regions {listed(self.regions)}, interfaces "
            f"{listed(self.interfaces)})"
        )

    def _repr_html_(self) -> str:
        carried = [("attachments", len(self.attachments))] if self.attachments else []
        regions = [("regions", listed(self.regions))] if self.regions else []
        faces = [(f"interface {i.name}", repr(i)) for i in self.interfaces.values()]
        rows = [("nodes", len(self.points)), *regions, *carried, *faces]
        return html_table(f"Finite element model of {self.n_dofs} dofs", ("", ""), rows)

    @property
    def n_dofs(self) -> int:
        """Number of dofs of the whole model."""
        turning = 0 if self.rotations is None else self.rotations.dofs.size
        return 3 * self.points.shape[0] + turning + self.n_scalars

    @property
    def interface_names(self) -> tuple[str, ...]:
        """Names of the interfaces."""
        return tuple(self.interfaces)

    def rigid_motions(self, about: Point = (0.0, 0.0, 0.0)) -> Array:
        """(n, 6) rigid motions of all its dofs, rotations about a point (3,) [1, m]."""
        return rigid_motions(self.points - np.asarray(about), self.rotations, self.n_dofs)

    def mass(self) -> float:
        """Total mass with attachments [kg]; under mpirun to be called on all ranks.

        Example:
            >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
            >>> beam = rom.fe.model("meshes/beam.geo", material=steel)  # 1 m x 50 mm x 30 mm
            >>> round(beam.mass(), 6)
            11.775
        """
        carried = sum(a.mass for a in self.attachments)
        if hasattr(self.M, "tocsr"):
            x = slice(0, 3 * len(self.points), 3)
            return float(self.M[x][:, x].sum()) + carried
        along_x = np.zeros((self.operators.n_local, 1))
        along_x[::3] = 1.0
        return self.operators.gram(along_x, self.operators.apply_M(along_x)).item() + carried


def refuse_springs(model: FEModel, why: str) -> None:
    """Raise a ModelError where springs, which know small motions alone, would be lost."""
    if model.springs:
        raise ModelError(f"the model has springs of a deck, {named(model.springs)}: {why}.")


@typed
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


@typed
@dataclass(frozen=True, slots=True)
class Basis:
    """Columns that span the deformations kept.

    Attributes:
        Psi: (n, r) displacement shapes [m] per unit of each coordinate, interface columns first;
            under mpirun the rows of this rank.
        omega: (m,) circular frequencies [rad/s] of the last m columns, ascending.
        labels: (r,) what each column is, e.g. "constraint 12" or "fixed-interface 3".
        held: the body with its boundary held, factored, of methods that have needed it.
    """

    Psi: Array
    omega: Array
    labels: tuple[str, ...]
    held: Any = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        n, r = self.Psi.shape
        return f"Basis({r} columns of {n} rows, {self.omega.size} of them modes)"

    def project(self, A: Any) -> Array:
        """(r, r) symmetric projection Psi^T A Psi in units of A and the shapes; on one process.

        Raises:
            ConfigError: if A is no (n, n) matrix.

        Example:
            >>> K = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])  # two springs
            >>> rom.craig_bampton(K, np.eye(3), [0, 2], n_modes=0).project(K)  # one, half as stiff
            array([[ 0.5, -0.5],
                   [-0.5,  0.5]])
        """
        n = len(self.Psi)
        B = self.Psi.T @ (matrix("A", A, (n, n)) @ self.Psi)
        return 0.5 * (B + B.T)


@typed
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
        error: (m,) at most this share [1] of a frequency is error of the search, none is too low;
            None where the search went down to round-off.
    """

    omega: Array
    shapes: Any
    residual: Any = None
    error: Any = None

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
        told = {"frequency [Hz]": self.frequencies, "residual": self.residual}
        told |= {"error below": self.error}
        told = {name: column for name, column in told.items() if column is not None}
        rows = zip(range(1, self.omega.size + 1), *told.values(), strict=True)
        return html_table(f"Modes: {self._said}", ("mode", *told), rows)


# What a row that fails costs the user, and the cure, by words of its quantity
MORE_MODES = "Leave n_modes (-m) out, and as many are kept as are needed; or give a larger one."
MORE_SHAPES = "Leave n_shapes out, or ask for a smaller tol, snapshots=True or smaller loads."
SMALLER_TOL = "Leave n_shapes out, or ask for a smaller tol (1e-5), or smaller loads."
SMALLER_STEPS = "Take smaller steps, dt or rtol."
FAILURE_COSTS = {
    "worst error of": f"Motions at these frequencies are off by as much. {MORE_MODES}",
    "estimated error of": f"Motions at these frequencies are off by about as much. {MORE_MODES}",
    "lowest MAC": f"A mode has another shape: stress and answers in it are wrong. {MORE_MODES}",
    "reduced never below full": "No reduction can do that: stiffness and mass are of different "
    "models, or a mode of the full model was missed.",
    "error over its estimate": "The estimates of this body are too small; go by the errors.",
    "by shapes left out": "The motion needs shapes that the bodies do not have; what has the "
    "largest share is named. Keep modes up to it, or the static shapes of inertia by "
    "rom.WithLoads; let interfaces deform by Polynomial in place of rbe2.",
    "by time steps": "The run is off by as much because of its steps. Take shorter ones.",
    "static flexibility": "Slow loads on the interfaces bend the body wrongly by as much. Use a "
    "method with constraint modes, such as CraigBampton.",
    "mass, centre, inertia": "It falls and turns otherwise than the part: shapes are missing.",
    "rigid motions inside the basis": "It resists moving as a whole: shapes are missing.",
    "energy of rigid motions": "The model resists moving as a whole: it is held somewhere, or its "
    "stiffness misses digits. Give a model that floats.",
    "stiffness against rigid motion": "The model resists moving as a whole: it is held somewhere, "
    "or its stiffness misses digits. Give a model that floats.",
    "scaled mass": "Two shapes are nearly the same and digits are lost. Keep fewer modes, or "
    "fewer coordinates per interface.",
    "largest deformation": "Linear elasticity about a floating frame ends here. Split the body "
    "into several, or take a rod that bends far.",
    "full states found": "No equilibrium of the full model is found there: ask for smaller loads.",
    ": displacement": f"Under these loads it bends wrongly by as much. {MORE_SHAPES}",
    "frequencies about it": f"Bent so far it vibrates wrongly by as much. {SMALLER_TOL}",
    "compliance of interfaces": "Bent so far it yields wrongly by as much to what else acts there, "
    f"as a torque. {SMALLER_TOL}",
    ": stress": f"Bent so far its stress is wrong by as much. {MORE_SHAPES}",
    "energy that cells add": "Cells are strained where they only turn. Mesh more finely along the "
    "body, or ask for smaller loads.",
    "certificate holds": "Nothing was compared with the full model there. Reduce it for larger "
    "loads, or for more shapes.",
    "softens it to nothing": "Centrifugal force would stiffen it, which this body does not know. "
    "Reduce it with stiffening=True.",
    "load that buckles it": "Pressed so much it bends more and vibrates more slowly, which this "
    "body does not know. Reduce it with stiffening=True.",
    "energy balance": f"Energy comes from nowhere or is lost. {SMALLER_STEPS}",
    "drift of energy": f"Energy comes from nowhere or is lost. {SMALLER_STEPS}",
    "change of ": f"Momentum changes though nothing pushes from outside. {SMALLER_STEPS}",
    "gap in a joint": f"Joints come apart. {SMALLER_STEPS}",
    "slip of what rolls": f"What rolls slips. {SMALLER_STEPS}",
    "chi-square of all residuals": "The model is not that of the test: deviations, which are those "
    "of noise alone, do not hold. Offer springs, masses and kept parameters as candidates; their "
    "scores say what is missing.",
    "steps of the search": "Where it stands says little: what is missing makes many values equally "
    "wrong. Free fewer parameters, give a prior, or offer what may be missing as candidates.",
    "median FRAC": "Nothing fits: see whether the data are of this body, its supports and its "
    "points.",
    "highest line over": "The basis has no modes to trust there. Leave these lines out, or reduce "
    "with more modes.",
    "inside its range": "The range ends before the best value: widen it, or something else is "
    "wrong.",
    "chi-square of the records, over": "The mechanism is not the one that was measured, the search "
    "began too far away, or there is more noise: deviations, of noise alone, do not hold.",
    "no less than noise leaves": "There is less noise than was said: deviations are too large, and "
    "a wrong mechanism may pass.",
    "memory of residuals": "What is left is no noise from value to value: deviations are too "
    "small. Something is missing in the mechanism, or values are too close in time.",
    "by the step of time": f"Parameters make up for errors of the motion. {SMALLER_STEPS}",
    "Newton corrections": f"Steps are hard to solve: something is stiff. {SMALLER_STEPS}",
}
RELATIONS = {"<=": operator.le, ">": operator.gt, "==": operator.eq}  # of a value to its limit
UNLIMITED_KINDS = ("information", "--", "")  # limits of values that are told, not judged
_WARNED_OF = WeakSet["Report"]()  # of whose failures a user was warned


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a report: a quantity, its value, its limit, and whether it holds."""

    quantity: str
    value: float
    limit: str
    ok: bool

    @property
    def limited(self) -> bool:
        """Whether the limit is one: a relation and a number, or words of what is not judged."""
        return self.limit in UNLIMITED_KINDS or self.limit.partition(" ")[0] in RELATIONS

    @property
    def excess(self) -> float:
        """How far the value is beyond its limit, over the limit; 0 within, infinite for NaN."""
        relation, _, number = self.limit.partition(" ")
        if np.isnan(self.value):
            return np.inf
        if self.limit in UNLIMITED_KINDS or RELATIONS[relation](self.value, limit := float(number)):
            return 0.0
        return abs((self.value - limit) / limit) if limit else np.inf


@typed
@dataclass(frozen=True, slots=True, weakref_slot=True)
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

    @property
    def worst(self) -> Row:
        """The row that is farthest beyond its limit, of those that fail if any does."""
        return max(self.failures or self.rows, key=lambda row: row.excess)

    def warn_of_failures(self, of: str) -> None:
        """Warn of rows that do not hold, once of each report.

        Args:
            of: what was checked, e.g. "the certificate of body 'rod'".

        Warns:
            RomWarning: with the worst row, what it costs, and what helps.
        """
        if self.ok or self in _WARNED_OF:
            return
        worst = self.worst
        warn(
            f"{of} fails in {len(self.failures)} of {len(self.rows)} rows; worst is "
            f"{worst.quantity!r}: {worst.value:.3g}, limit {worst.limit}. "
            + " ".join(Report("", (worst,)).advice)
        )
        _WARNED_OF.add(self)

    @property
    def advice(self) -> tuple[str, ...]:
        """What the rows that fail cost the user, and what helps."""
        pairs = ((row.quantity, *cost) for row in self.failures for cost in FAILURE_COSTS.items())
        return tuple(dict.fromkeys(text for quantity, words, text in pairs if words in quantity))

    def __str__(self) -> str:
        width = max((len(row.quantity) for row in self.rows), default=0)
        lines = [
            f"  {row.quantity:<{width}}  {row.value:>12.5g}  {row.limit:<16}  "
            + ("ok" if row.ok else "FAILED")
            for row in self.rows
        ]
        advice = [f"  -> {text}" for text in self.advice]
        return "\n".join([f"{self.title}: {self._verdict}", *lines, *advice])

    def __repr__(self) -> str:
        return f"Report({self.title!r}: {self._verdict})"

    @property
    def _verdict(self) -> str:
        return "ok" if self.ok else f"{len(self.failures)} of {len(self.rows)} failed"

    def _repr_html_(self) -> str:
        ordered = (*self.failures, *(row for row in self.rows if row.ok))
        rows = ((r.quantity, r.value, r.limit, "ok" if r.ok else "FAILED") for r in ordered)
        return html_table(
            f"{self.title}: {self._verdict}", ("quantity", "value", "limit", ""), rows
        )
