"""A finite element model from matrices and nodes of another program."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.sparse import block_diag, bsr_matrix, csr_matrix, diags, identity, kron
from scipy.spatial import cKDTree

from rom.arguments import symmetric, typed
from rom.errors import (
    ConfigError,
    FileFormatError,
    InterfaceError,
    ModelError,
    QualityGateError,
    in_file,
)
from rom.io.matrices.dmig import Dofs
from rom.io.matrices.matrix_files import NamedMatrix, read_matrix
from rom.io.matrices.node_files import CARDS, read_dofs, read_node_sets, read_nodes
from rom.model import Array, FEModel, Index, Interface, Rotations
from rom.plausible import DENSITY, MATRIX_SPEED, SIZE, warn_outside
from rom.units import unit_system

ASYMMETRY_RTOL, MIXED_MASS_RTOL, RIGID_RTOL = 1e-6, 1e-6, 1e-6
UNFELT_RTOL = 1e-14  # square of what a rotation feels, of the most at its node, that is nothing
MORE_NODES = 5
# sqrt(K_ii / M_ii) times the distance of the next node over sqrt(E/rho); 1.6 to 3.3 for blocks,
# beams, rods and phalanges of bricks and tetrahedra of either degree
NODE_SPEED = 2.3
MOST_SHOWN = 60  # characters of a wrong value


@typed
def read_model(  # noqa: PLR0913  one keyword per choice
    K: str | Path | tuple[str | Path, str],
    M: str | Path | tuple[str | Path, str],
    *,
    nodes: str | Path | tuple[npt.ArrayLike, ...],
    interfaces: Mapping[str, npt.ArrayLike] | Sequence[str],
    D: str | Path | tuple[str | Path, str] | None = None,
    dofs: str | Path | Index | None = None,
    units: str = "SI",
    modal: npt.ArrayLike = (),
    hold_drilling: bool = False,
) -> FEModel:
    """A free body from the matrices of another program, to be reduced here.

    Solids, structures whose nodes turn, and superelements: bodies that are reduced already.

    Args:
        K: stiffness of the body without supports: file, or (file, name), see
            `rom.io.matrices.matrix_files.read_matrix`.
        M: mass, likewise; of solids the same along x, y and z. Rotations may have none.
        nodes: (k,) labels and (k, 3) positions, in units of the files, and where the rows of
            nodes follow axes of their own (k, 3, 3), these as columns; or a file: ``.inp`` with
            ``*NODE``, ``.bdf``, ``.dat``, ``.pch``, ``.asm`` or ``.dmig`` with GRID cards, ``.csv``
            with lines ``label, x, y, z``. Nodes without a row are left out where rows have labels.
            Masses, springs and rigid elements of a deck are in the matrices, and none is added.
        interfaces: {name: (m,) labels of its nodes}, or names of ``*NSET`` in the
            ``.inp`` of the nodes; all nodes of an interface weigh the same.
        D: damping, likewise, which bodies then have; it may not resist motions as a whole.
        dofs: what the rows of matrices without labels are: (n, 2) labels and components 1 to 6, 0
            without a place; or a file: ``.csv`` with lines ``label, component``, ``.mapping`` of
            Ansys, or the cards of a superelement, ``.pch`` or ``.asm`` with EXTRN, which need not
            be named again where they are the nodes. Rows behind them are amplitudes of modes. If
            missing, rows are those of the nodes in ascending order, 3 or 6 for each.
        units: unit system of the files; the model is in SI.
        modal: labels whose rows are amplitudes of modes; scalar points are that anyway.
        hold_drilling: leave out rotations without stiffness and mass, as flat shells have about
            their normals.

    Raises:
        ConfigError: for unknown endings, names or units.
        FileFormatError: if a file is missing, damaged, or does not fit the others.
        InterfaceError: if an interface names no nodes, or unknown ones.
        ModelError: if a node does not move along three axes, naming rotations without stiffness,
            if the mass is not that of a body, or ``modal`` names no row.
        QualityGateError: if a matrix is not symmetric, or the body is not free.
        UnsafeFileError: if a file asks for more memory than its size can mean.

    Warns:
        RomWarning: if size, density or speed of sound are those of no solid: wrong units.

    Example:
        >>> file = rom.export(rom.load("beam.rom.npz"), "beam.dmig")  # 2 rigid ends, 4 modes
        >>> ends = {"root": [1], "tip": [2]}
        >>> rom.read_model((file, "KAAX"), (file, "MAAX"), nodes=file, interfaces=ends)
        FEModel(16 dofs, regions none, interfaces root, tip)
    """
    unit = unit_system(units)
    labels, points, axes = read_nodes(nodes)
    if not isinstance(interfaces, Mapping):
        names = (interfaces,) if isinstance(interfaces, str) else tuple(interfaces)
        if not isinstance(nodes, str | Path):
            raise ConfigError("names of interfaces need nodes from an .inp file, with its sets.")
        interfaces = read_node_sets(nodes, names)
    found = [read_matrix(source) for source in (K, M, D) if source is not None]
    if dofs is None and isinstance(nodes, str | Path) and Path(nodes).suffix.lower() in CARDS:
        dofs = nodes
    if dofs is not None and (table := read_dofs(dofs)) is not None:
        found = [A if A.dofs is not None else _listed(A, table) for A in found]
    layout = _layout(found, labels, points, axes, np.atleast_1d(modal))
    stiffness, mass, *damping = (layout.placed(A) for A in found)
    kept = layout.rotations(stiffness, mass, hold=hold_drilling)
    T, rotations, points = kept[0], kept[1], layout.points * unit.length
    T = T @ diags(np.where(np.arange(T.shape[1]) < points.size, 1.0, unit.length))
    model = FEModel(
        T.T @ stiffness @ T * (unit.force / unit.length),
        T.T @ mass @ T * unit.mass,
        points,
        {n: _interface(n, own, layout.labels, points, rotations) for n, own in interfaces.items()},
        provenance={"K": found[0].where, "M": found[1].where, "units": units},
        rotations=rotations,
        n_scalars=len(layout.scalars),
        D=T.T @ damping[0] @ T * (unit.mass / unit.time) if damping else None,
    )
    _check_free("stiffness", model.K, model)
    if D is not None:
        _check_free("damping", model.D, model)
    _refuse_multipliers(model.K)
    _check_mass(model)
    _doubt_units(model)
    return model


@dataclass(frozen=True, slots=True)
class _Layout:
    """Rows of a model before rotations are chosen: 3 k displacements, 3 k rotations, scalars."""

    labels: Index  # (k,) ascending
    points: Array  # (k, 3) in units of the files
    axes: Array  # (k, 3, 3) along which rows move, as columns
    scalars: Dofs  # (s, 2) label and component, ascending

    def placed(self, found: NamedMatrix) -> csr_matrix:
        """(6 k + s, 6 k + s) symmetric matrix, its rows along the axes of the body."""
        with in_file(found.where):
            A = _completed(found.A)
            place = self._rows(_labelled(A, found.dofs, self.labels))
        n = 6 * self.labels.size + len(self.scalars)
        rows = np.ones(place.size), (place, np.arange(place.size))
        pick = csr_matrix(rows, shape=(n, A.shape[0]))
        if (self.axes != np.eye(3)).any():
            both, k = np.concatenate([self.axes, self.axes]), np.arange(2 * self.labels.size + 1)
            Q = bsr_matrix((both, k[:-1], k))
            pick = block_diag([Q, identity(len(self.scalars))]) @ pick
        return (pick @ A @ pick.T).tocsr()

    def _rows(self, dofs: Dofs) -> Index:
        """Row in this layout of each row of a matrix."""
        k, component = self.labels.size, dofs[:, 1] - 1
        scalars = {row: 6 * k + i for i, row in enumerate(map(tuple, self.scalars.tolist()))}
        place = np.array([scalars.get((i, c), -1) for i, c in dofs.tolist()], dtype=np.int64)
        scalar = place >= 0
        node, strange = _places(self.labels, dofs[~scalar, 0])
        if strange:
            raise FileFormatError(f"rows belong to nodes that are not given: {strange}.")
        turn = component[~scalar] >= 3
        place[~scalar] = 3 * node + component[~scalar] + (3 * k - 3) * turn
        return place

    def rotations(
        self, K: csr_matrix, M: csr_matrix, *, hold: bool
    ) -> tuple[csr_matrix, Rotations | None]:
        """Which combinations of the rows are dofs of the model, and those that turn nodes."""
        k, n = self.labels.size, K.shape[0]
        turning = slice(3 * k, 6 * k)
        nodes, axes, loose = _felt(K[turning], M[turning])
        if loose.size and not hold:
            named = ", ".join(map(str, self.labels[loose[:MORE_NODES]]))
            raise ModelError(
                f"{loose.size} nodes turn about an axis without stiffness and mass (nodes {named}"
                f"{', …' if loose.size > MORE_NODES else ''}), as those of flat shells about their "
                "normals.",
                hint="Give hold_drilling=True to leave these rotations out; nothing feels them.",
            )
        t, row = nodes.size, (3 * nodes[:, None] + np.arange(3)).ravel()
        R = csr_matrix((axes.ravel(), (row, np.repeat(np.arange(t), 3))), shape=(3 * k, t))
        T = block_diag([identity(3 * k), R, identity(n - 6 * k)], format="csr")
        return T, Rotations(nodes, axes, 3 * k + np.arange(t)) if t else None


def _felt(K: csr_matrix, M: csr_matrix) -> tuple[Index, Array, Index]:
    """Nodes (t,) and axes (t, 3) of rotations that stiffness or mass feels, of 3 rows a node.

    Also nodes that turn about some axes and not about others. Whole triples keep x, y and z.
    """
    squares = [_squares(A) for A in (K, M)]  # each over the most at its node
    G = sum(S / S.max(axis=(1, 2), initial=np.finfo(float).tiny, keepdims=True) for S in squares)
    size, V = np.linalg.eigh(G)
    felt = (size > UNFELT_RTOL * size[:, -1:]) & (size[:, -1:] > 0.0)
    V[felt.all(axis=1)] = np.eye(3)
    node, column = np.nonzero(felt)
    return node, V[node, :, column], np.flatnonzero(felt.any(axis=1) & ~felt.all(axis=1))


def _squares(A: csr_matrix) -> Array:
    """(k, 3, 3) products of the rows of one node with each other, of 3 rows a node."""
    found = np.zeros((A.shape[0] // 3, 3, 3))
    for a in range(3):
        for b in range(a, 3):
            found[:, a, b] = found[:, b, a] = A[a::3].multiply(A[b::3]).sum(axis=1).A1
    return found


def _listed(A: NamedMatrix, table: Dofs) -> NamedMatrix:
    """With a table of its rows; those behind it are coordinates without a place."""
    more = np.arange(1, A.A.shape[0] - len(table) + 1)
    if A.A.shape[0] < len(table):
        text = f"it has {A.A.shape[0]} rows; the table of dofs has {len(table)}"
        hint = "Nastran writes one row for a matrix that is none; leave it out."
        raise FileFormatError(f"{text}.", where=A.where, hint=hint)
    behind = np.column_stack([table[:, 0].max(initial=0) + more, np.zeros_like(more)])
    return replace(A, dofs=np.concatenate([table, behind]))


def _layout(
    found: list[NamedMatrix], labels: Index, points: Array, axes: Array, modal: Index
) -> _Layout:
    """Nodes and scalars of labelled rows; nodes in no row, for loads and pictures, are left out."""
    if any(A.dofs is None for A in found):
        return _Layout(labels, points, axes, np.zeros((0, 2), dtype=np.int64))
    dofs = np.unique(np.concatenate([A.dofs for A in found if A.dofs is not None]), axis=0)
    if (unknown := np.setdiff1d(modal, dofs[:, 0])).size:
        raise ModelError(f"modal names {unknown[:MORE_NODES].tolist()}, which no row belongs to.")
    own, n_rows = np.unique(dofs[:, 0], return_counts=True)
    sole = own[n_rows == 1]  # of modes that other programs put on nodes of their own
    placed = labels[points.any(axis=1)]  # at zero, where nodes of modes are
    scalar = (dofs[:, 1] == 0) | np.isin(dofs[:, 0], np.setdiff1d(sole, placed))
    scalar |= np.isin(dofs[:, 0], modal)
    scalars, dofs = dofs[scalar], dofs[~scalar]
    used = np.isin(labels, dofs[:, 0])
    own, n_rows = np.unique(dofs[dofs[:, 1] <= 3, 0], return_counts=True)
    halves = np.union1d(own[n_rows < 3], np.setdiff1d(dofs[:, 0], own))
    if halves.size:
        has = dofs[dofs[:, 0] == halves[0], 1].tolist()
        raise ModelError(
            f"{halves.size} nodes do not move along three axes: node {halves[0]} has the "
            f"components {has} alone.",
            hint="Write K and M without supports; give labels of modes as modal=.",
        )
    return _Layout(labels[used], points[used], axes[used], scalars)


def _labelled(A: csr_matrix, dofs: Dofs | None, labels: Index) -> Dofs:
    """(n, 2) node and component of each row; 3 or 6 rows a node where the file has no labels."""
    if dofs is not None:
        return dofs
    per_node, remainder = divmod(A.shape[0], labels.size)
    if remainder or per_node not in (3, 6):
        raise FileFormatError(
            f"{A.shape[0]} rows are neither 3 nor 6 for each of {labels.size} nodes."
        )
    nodes = np.repeat(labels, per_node)
    return np.column_stack([nodes, np.tile(np.arange(1, per_node + 1), labels.size)])


def _places(labels: Index, wanted: Index) -> tuple[Index, list[int]]:
    """Where wanted ones stand among all labels, and the first that do not."""
    strange = np.setdiff1d(wanted, labels)[:MORE_NODES].tolist()
    return np.searchsorted(labels, wanted), strange


def _completed(A: csr_matrix) -> csr_matrix:
    """The whole matrix; entries without their mirror image get it."""
    there = csr_matrix((np.ones(A.nnz), A.indices, A.indptr), shape=A.shape)
    both = there.multiply(there.T)
    A = csr_matrix(A + A.T - A.T.multiply(both))
    if not A.nnz:
        raise FileFormatError("the matrix is empty.")
    symmetric("the matrix", A, ASYMMETRY_RTOL)
    return csr_matrix(0.5 * (A + A.T))


def _interface(
    name: str, wanted: npt.ArrayLike, labels: Index, points: Array, rotations: Rotations | None
) -> Interface:
    try:
        own = np.unique(np.asarray(wanted, dtype=np.int64))
    except (TypeError, ValueError, OverflowError):
        raise InterfaceError(
            f"interface {name!r}: {repr(wanted)[:MOST_SHOWN]} must be labels of nodes."
        ) from None
    node, strange = _places(labels, own)
    if strange or not own.size:
        raise InterfaceError(f"interface {name!r} needs nodes of the model; unknown are {strange}.")
    node = node[np.lexsort(points[node].T[::-1])]
    weights = identity(node.size, format="csr") / node.size
    turning = None if rotations is None else rotations.of(node)
    return Interface(
        name, node, points[node], weights, points[node].mean(axis=0), rotations=turning
    )


def _refuse_multipliers(K: csr_matrix) -> None:
    """Rows that ties or pressure have added are no motions."""
    felt = abs(K).max(axis=1).toarray().ravel() > 0.0
    if multipliers := np.count_nonzero((K.diagonal() <= 0.0) & felt):
        raise ModelError(
            f"{multipliers} rows of the stiffness have entries, but none on their diagonals, as "
            "those of Lagrange multipliers.",
            hint="Let ties be eliminated, and leave hybrid elements out.",
        )


def _check_mass(model: FEModel) -> None:
    """The mass of solids is the same along x, y and z at each node, of other bodies as a whole."""
    diagonal = model.M.diagonal()
    if diagonal.min() < -MIXED_MASS_RTOL * diagonal.max(initial=0.0):
        raise ModelError(
            f"{np.count_nonzero(diagonal < 0.0)} entries on the diagonal of the mass are negative.",
            hint="Write M consistent, or lumped in another way.",
        )
    if model.n_dofs == model.points.size:
        scalar = model.M[::3][:, ::3]
        apart = abs(model.M - kron(scalar, identity(3))).max() / abs(model.M).max()
    else:
        R = _motions(model)[:, :3]
        rigid = R.T @ model.M @ R
        apart = np.abs(rigid - np.eye(3) * rigid[0, 0]).max() / np.abs(rigid).max()
    if apart > MIXED_MASS_RTOL:
        raise ModelError(
            "the mass is not the same along x, y and z, or couples them: it is not that of solid "
            "elements.",
            hint="Leave concentrated inertias out; rom.Attachment adds them.",
        )


def _motions(model: FEModel) -> Array:
    """(n, 6) rigid motions, rotations about the middle of the nodes, as large as translations."""
    centre = model.points.mean(axis=0)
    R = model.rigid_motions(centre)
    R[:, 3:] /= max(np.abs(model.points - centre).max(), 1e-300)
    return R


def _check_free(what: str, A: csr_matrix, model: FEModel) -> None:
    """Rigid motions must be free of force; supports and rows left out are seen here."""
    residual = np.abs(A @ _motions(model)).max() / max(abs(A).max(), 1e-300)
    if not residual < RIGID_RTOL:
        hint = "Write K without boundary conditions; check nodes, axes, units and labels of modes."
        if what == "damping":
            hint = "Leave D out; rom.Rayleigh damps the deformation in proportion to the mass."
        raise QualityGateError(
            f"a rigid motion meets the {what} {residual:.2g} of its largest entry: the body is "
            "supported, or its nodes are not those of the matrix.",
            where=str(model.provenance["K"]),
            hint=hint,
        )


def _doubt_units(model: FEModel) -> None:
    """Warn if size, density or speed of sound are those of no solid."""
    box = np.ptp(model.points, axis=0)
    of = f"the body of {model.provenance['K']}"
    warn_outside(SIZE, float(np.linalg.norm(box)), of)
    if model.n_dofs > model.points.size:
        return  # where nodes turn, wrong lengths already meet stiffness
    if box.min() > 0.0:
        warn_outside(DENSITY, model.mass() / float(box.prod()), of)
    warn_outside(MATRIX_SPEED, _speed_of_sound(model), of)


def _speed_of_sound(model: FEModel) -> float:
    """About sqrt(E/rho): entries of K and M at a node and the distance of its neighbour."""
    if len(model.points) < 2:
        return float(MATRIX_SPEED.low or 0.0)
    near = cKDTree(model.points).query(model.points, k=2)[0][:, 1]
    k, m = (A.diagonal().reshape(-1, 3).sum(axis=1) for A in (model.K, model.M))
    return float(np.median(near * np.sqrt(k / m)) / NODE_SPEED)
