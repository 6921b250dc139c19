"""A finite element model from matrices and nodes of another program."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix, identity, kron
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
from rom.io.matrices.node_files import read_node_sets, read_nodes
from rom.model import Array, FEModel, Index, Interface
from rom.plausible import DENSITY, MATRIX_SPEED, SIZE, warn_outside
from rom.units import unit_system

ASYMMETRY_RTOL, MIXED_MASS_RTOL, RIGID_RTOL = 1e-6, 1e-6, 1e-6
MORE_NODES = 5
# sqrt(K_ii / M_ii) times the distance of the next node over sqrt(E/rho); 1.6 to 3.3 for blocks,
# beams, rods and phalanges of bricks and tetrahedra of either degree
NODE_SPEED = 2.3
MOST_SHOWN = 60  # characters of a wrong value


@typed
def read_model(
    K: str | Path | tuple[str | Path, str],
    M: str | Path | tuple[str | Path, str],
    *,
    nodes: str | Path | tuple[npt.ArrayLike, npt.ArrayLike],
    interfaces: Mapping[str, npt.ArrayLike] | Sequence[str],
    units: str = "SI",
) -> FEModel:
    """A free solid body from the matrices of another program, to be reduced here.

    Args:
        K: stiffness of the body without supports: file, or (file, name), see
            `rom.io.matrices.matrix_files.read_matrix`.
        M: mass, likewise; the same along x, y and z, as that of solid elements.
        nodes: (k,) labels and (k, 3) positions, in units of the files; or a file: ``.inp`` with
            ``*NODE``, ``.bdf`` or ``.dat`` with GRID cards, ``.csv`` with lines ``label, x, y, z``.
            Rows of matrices without labels are those of the nodes in ascending order, 3 or 6 for
            each; where all rows have labels, nodes without a row are left out.
        interfaces: {name: (m,) labels of its nodes}, or names of ``*NSET`` in the
            ``.inp`` of the nodes; all nodes of an interface weigh the same.
        units: unit system of the files; the model is in SI.

    Raises:
        ConfigError: for unknown endings, names or units.
        FileFormatError: if a file is missing, damaged, or does not fit the others.
        InterfaceError: if an interface has no nodes, or unknown ones.
        ModelError: if nodes turn, as those of beams and shells, or the mass is not that of a solid.
        QualityGateError: if a matrix is not symmetric, or the body is not free.
        UnsafeFileError: if a file asks for more memory than its size can mean.

    Warns:
        RomWarning: if size, density or speed of sound are those of no solid: wrong units.
    """
    unit = unit_system(units)
    labels, points = read_nodes(nodes)
    if not isinstance(interfaces, Mapping):
        names = (interfaces,) if isinstance(interfaces, str) else tuple(interfaces)
        if not isinstance(nodes, str | Path):
            raise ConfigError("names of interfaces need nodes from an .inp file, with its sets.")
        interfaces = read_node_sets(nodes, names)
    found = [read_matrix(source) for source in (K, M)]
    labels, points = _used(labels, points, found)
    stiffness, mass = (_placed(A, labels) for A in found)
    points = points * unit.length
    model = FEModel(
        stiffness * (unit.force / unit.length),
        mass * unit.mass,
        points,
        {name: _interface(name, own, labels, points) for name, own in interfaces.items()},
        provenance={"K": _name(K), "M": _name(M), "units": units},
    )
    _check_mass(model)
    _check_free(model)
    _doubt_units(model)
    return model


def _used(labels: Index, points: Array, found: list[NamedMatrix]) -> tuple[Index, Array]:
    """Nodes without those in no row, as decks carry them for loads and pictures."""
    rows = [A.dofs[:, 0] for A in found if A.dofs is not None]
    if len(rows) < len(found):
        return labels, points
    used = np.isin(labels, np.concatenate(rows))
    return labels[used], points[used]


def _placed(found: NamedMatrix, labels: Index) -> csr_matrix:
    """(3 k, 3 k) symmetric matrix in the order of the nodes."""
    with in_file(found.where):
        A = _completed(found.A)
        place = _rows(A, found.dofs, labels)
    moving = place >= 0
    pick = csr_matrix(
        (np.ones(moving.sum()), (place[moving], np.flatnonzero(moving))),
        shape=(3 * labels.size, A.shape[0]),
    )
    return (pick @ A @ pick.T).tocsr()


def _rows(A: csr_matrix, dofs: Dofs | None, labels: Index) -> Index:
    """Row in the model of each row of a matrix; -1 for rotations, which must be empty."""
    if dofs is None:
        per_node, remainder = divmod(A.shape[0], labels.size)
        if remainder or per_node not in (3, 6):
            raise FileFormatError(
                f"{A.shape[0]} rows are neither 3 nor 6 for each of {labels.size} nodes."
            )
        nodes = np.repeat(labels, per_node)
        dofs = np.column_stack([nodes, np.tile(np.arange(1, per_node + 1), labels.size)])
    node, strange = _places(labels, dofs[:, 0])
    if strange:
        raise FileFormatError(f"rows belong to nodes that are not given: {strange}.")
    turning = (dofs[:, 1] < 1) | (dofs[:, 1] > 3)
    if np.abs(A[turning]).sum() > 0:
        label, component = dofs[np.flatnonzero(turning)[0]]
        raise ModelError(
            f"node {label} has the component {component}: nodes that turn are those of beams and "
            "shells; this body has to be a solid."
        )
    return np.where(turning, -1, 3 * node + dofs[:, 1] - 1)


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


def _interface(name: str, wanted: npt.ArrayLike, labels: Index, points: Array) -> Interface:
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
    return Interface(name, node, points[node], weights, points[node].mean(axis=0))


def _check_mass(model: FEModel) -> None:
    scalar = model.M[::3][:, ::3]
    if abs(model.M - kron(scalar, identity(3))).max() > MIXED_MASS_RTOL * abs(model.M).max():
        raise ModelError(
            "the mass is not the same along x, y and z, or couples them: it is not that of solid "
            "elements.",
            hint="Leave concentrated inertias out; rom.Attachment adds them.",
        )


def _check_free(model: FEModel) -> None:
    """Rigid motions must be free of force; supports and rows left out are seen here."""
    X = model.points - model.points.mean(axis=0)
    size = max(np.abs(X).max(), 1e-300)
    turns = [np.cross(axis, X / size) for axis in np.eye(3)]
    R = np.column_stack([*(np.tile(axis, len(X)) for axis in np.eye(3)), *map(np.ravel, turns)])
    residual = np.abs(model.K @ R).max() / abs(model.K).max()
    if not residual < RIGID_RTOL:
        raise QualityGateError(
            f"a rigid motion meets the stiffness {residual:.2g} of its largest entry: the body is "
            "supported, or its nodes are not those of the matrix.",
            where=str(model.provenance["K"]),
            hint="Write K without boundary conditions, and check nodes and units.",
        )


def _doubt_units(model: FEModel) -> None:
    """Warn if size, density or speed of sound are those of no solid."""
    box = np.ptp(model.points, axis=0)
    of = f"the body of {model.provenance['K']}"
    warn_outside(SIZE, float(np.linalg.norm(box)), of)
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


def _name(source: str | Path | tuple[str | Path, str]) -> str:
    return " ".join(map(str, source)) if isinstance(source, tuple) else str(source)
