"""Nodes that a deck ties, loads with masses or hangs on springs, found again in a model."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csr_matrix, diags
from scipy.spatial import cKDTree

from rom.eigen.verbs import coupled, mean_motion
from rom.errors import MeshError
from rom.fe.forms.nodes import by_position
from rom.fe.mesh.cell_types import CELL_TYPES, READ_TYPES
from rom.fe.mesh.solid import SolidMesh, Spring, Tie
from rom.fe.operators.aij import wrapped
from rom.model import Array, FEModel, Index, Interface

MATCH_RTOL = 1e-8  # of the size, up to which two nodes are at one place
OF_DEGREE = {"tetrahedron": ("tet4", "tet10"), "hexahedron": ("hex8", "hex27")}


def nodes_at(points: Array, wanted: Array, name: str) -> Index:
    """(k,) rows of points (n, 3) at the wanted ones (k, 3).

    Raises:
        MeshError: where there is no node, or more than one.
    """
    near = MATCH_RTOL * float(np.linalg.norm(np.ptp(points, axis=0)))
    there = cKDTree(points).query_ball_point(wanted, near)
    counts = np.array([len(rows) for rows in there])
    if (counts != 1).any():
        k = int((counts != 1).argmax())
        where = ", ".join(f"{v:.6g}" for v in wanted[k])
        raise MeshError(
            f"{name}: {counts[k]} nodes lie at ({where}) m, where the deck ties or loads one.",
            hint="Merge nodes at one place; nodes amid edges need degree=2.",
        )
    return np.array([rows[0] for rows in there], dtype=np.int64)


def tied(name: str, tie: Tie, points: Array, surface: Interface | None) -> Interface:
    """The interface of nodes that a deck ties; the surface of its name where it has these nodes."""
    nodes, place = np.unique(nodes_at(points, tie.points, name), return_inverse=True)
    if surface is not None and not tie.weights.size:
        if tie.kind == "rbe3" or np.array_equal(np.sort(surface.nodes), nodes):
            return replace(surface, origin=tie.origin)
    weights = np.bincount(place, tie.weights) if tie.weights.size else np.ones(nodes.size)
    order = by_position(points[nodes], np.ptp(points, axis=0).max())
    nodes, S = nodes[order], diags(weights[order] / weights.sum(), format="csr")
    return Interface(name, nodes, points[nodes], S, tie.origin)


def of_degree(mesh: SolidMesh, degree: int) -> dict[str, Tie]:
    """The ties of a deck between the nodes of displacements of a degree.

    A node that the deck does not have is tied where all that it lies between are: on edges, faces
    and cells all of whose nodes are.

    Raises:
        MeshError: if displacements of this degree have not the nodes of the deck.
    """
    if mesh.ties and not mesh.kind.degree <= degree <= 2:
        raise MeshError(
            f"the deck ties or loads nodes of cells of degree {mesh.kind.degree}, and "
            f"displacements of degree {degree} have other ones.",
            hint="Use degree=2.",
        )
    return {name: _completed(mesh, name, tie, degree) for name, tie in mesh.ties.items()}


def _completed(mesh: SolidMesh, name: str, tie: Tie, degree: int) -> Tie:
    listed = np.zeros(len(mesh.points), dtype=bool)
    listed[nodes_at(mesh.points, tie.points, name)] = True
    if tie.kind != "rbe2":
        return tie
    kind = READ_TYPES["hex20" if mesh.cell_type == "hex27" else mesh.cell_type]
    near = mesh.cells[listed[mesh.cells].any(axis=1)]
    found = []
    for support in CELL_TYPES[OF_DEGREE[kind.shape][degree - 1]].supports:
        between = [k for k, own in enumerate(kind.supports) if set(own) <= set(support)]
        tied = near[listed[near[:, kind.among([support]) or between]].all(axis=1)]
        own = mesh.kind.among([support]) or support  # amid straight edges where there is none
        found.append(mesh.points[tied[:, own]].mean(axis=1))
    return Tie(np.vstack(found), np.ones(0), tie.origin, tie.kind)


def sprung(model: FEModel, springs: Sequence[Spring]) -> FEModel:
    """The model with springs between what its interfaces do in the mean, in its stiffness."""
    ops = model.operators
    dK = csr_matrix((ops.n_local, ops.n))
    for one in springs:
        ends = [model.interfaces[name] for name in one.ends]
        B = block_diag(*(mean_motion(e) if e.nodes.size > 1 else np.eye(6, 3) for e in ends))
        block, dofs = B.T @ one.stiffness @ B, np.concatenate([end.dofs for end in ends])
        dK = dK + coupled(dK.shape, ops.first, dofs, 0.5 * (block + block.T))
    alone = hasattr(model.K, "tocsr")
    K = csr_matrix(model.K + dK) if alone else ops.plus(ops.K, dK)
    ops = ops.like(wrapped(K) if alone else K, ops.M, ops.rigid)
    return replace(model, K=K, operators=ops, springs=tuple(one.name for one in springs))
