"""Two interfaces that move together: nodes by position, coefficients, or moments of functions.

And what shows that coupled bodies stand for the whole: their certificates, put together.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import block_diag
from scipy.spatial import cKDTree

from rom.body.records import Marker, Patch
from rom.eigen.supports import FULL_TURNING
from rom.eigen.verbs import dofs_of, new_part
from rom.errors import InterfaceError
from rom.model import Array, Index, Interface, Row
from rom.names import named

Place = tuple[str, str]  # body, interface
Coupling = tuple[Place, Place]
SAME_PLACE = 1e-6  # relative distance of two nodes or interfaces that still meet
SAME_SURFACE = (0.05, 0.25)  # gap of centroids over extent, and of areas, of two faceted surfaces
SAME_FUNCTIONS = 1e-6  # difference of functions at equal nodes, of the largest value
MISSING_ROWS = (Row("certificate", 0.0, "> 0", False),)  # of a body that has none
MIN_COMMON_RATIO = 0.5  # norm of a function on one mesh, of that on the other, to be common to both


def coupled_rows(
    coupling: Coupling, one: Marker, other: Marker, size: float, projection: Any
) -> tuple[Array, Array]:
    """(n_c, 6 + r) of either body: interface coordinates that agree when both move together.

    Nodes that coincide are coupled node by node, whatever their order; equal functions by their
    coefficients; everything else by moments of common functions, if a projection is given.
    """
    rigid, differ = one.patch is None or other.patch is None, len(one.hold) != len(other.hold)
    if one.kind != other.kind or (rigid and differ):
        first = f"{coupling[0]} is {one.kind} with {len(one.hold)} coordinates"
        text = f"{first}, {coupling[1]} is {other.kind} with {len(other.hold)}"
        raise unlike(text)
    if rigid:
        refuse_gap(coupling, one.point - other.point, SAME_PLACE * size)
        return one.hold, other.hold
    order = _same_nodes(one.patch, other.patch, SAME_PLACE * size)
    if order is None:
        _refuse_other_surface(coupling, one.patch, other.patch)
    equal = _equal_coordinates(one, other, order)
    if equal is not None:
        return equal
    if projection is not None:
        return projected_rows(one, other, projection)
    n, m = (marker.patch.points.shape[0] for marker in (one, other))
    if order is None:
        text = f"{coupling[0]} has {n} nodes, {coupling[1]} has {m}, and they do not coincide."
        hint = "Couple moments of common functions: Assembly(…, projection=rom.Polynomial(4))."
        raise InterfaceError(text, hint=hint)
    text = f"{coupling[0]} and {coupling[1]} share {n} nodes, but each is reduced to functions of"
    hint = "Give both the same functions, or full interfaces to Assembly.reduced(…)."
    raise InterfaceError(f"{text} its own: coupled node by node they would lock.", hint=hint)


def projected_rows(one: Marker, other: Marker, projection: Any) -> tuple[Array, Array]:
    """Coefficients of the best approximation of both motions by common functions.

    With functions V of the surface, in one frame and scale for both meshes, and the surface mass S
    of each mesh, c = (V^T S V)^-1 V^T S u. Displacements that the functions contain, rigid motion
    and uniform strain above all, have the same c on any two meshes and pass without error. On one
    plane c_1 = c_2 is the condition that all moments of u_1 - u_2 with the functions vanish.

    Source:
        the projection of the mortar method, Bernardi, Maday and Patera (1994), with polynomials of
        the whole interface as multipliers.
    """
    a, b = one.patch, other.patch
    if turning := [m.name for m in (one, other) if m.kind.startswith(FULL_TURNING)]:
        raise unlike(f"nodes of interface {named(turning)} turn, and functions only displace")
    V_a, V_b, Q_a, Q_b = _common_functions(a, b, projection)
    SQ_a, SQ_b = a.surface_mass @ Q_a, b.surface_mass @ Q_b
    # V = Q T with T = Q^T S V on either side; coefficients of V, in multiples of T_a
    L_b = (SQ_a.T @ V_a) @ np.linalg.solve(SQ_b.T @ V_b, SQ_b.T)
    return _nodal(SQ_a.T, one), _nodal(L_b, other)


def _nodal(L: Array, marker: Marker) -> Array:
    """(3m, 6 + r) what (m, k) functionals of the nodal displacements say of the coordinates."""
    shapes = marker.patch.shapes
    return np.kron(L, np.eye(3)) @ (marker.hold if shapes is None else shapes @ marker.hold)


def _common_functions(a: Patch, b: Patch, projection: Any) -> tuple[Array, ...]:
    """The same functions on both meshes, in one frame and scale, and orthonormal on each.

    V_a (k_a, m), V_b (k_b, m), and Q_a, Q_b with Q^T S Q = I and the span of V. From low to high
    degree; left out is what depends on earlier ones, or what the meshes see differently: facets of
    a curved surface, and degrees beyond the resolution of one mesh.
    """
    points = np.vstack([a.points, b.points])
    S = block_diag([a.surface_mass, b.surface_mass], format="csr")
    both = Interface("both", np.arange(len(points)), points, S, points.mean(axis=0))
    V_a, V_b = np.split(projection.functions(both), [a.points.shape[0]])
    kept: list[int] = []
    Q_a, Q_b = V_a[:, :0], V_b[:, :0]
    for j in range(V_a.shape[1]):
        q_a, new_a = new_part(Q_a, V_a[:, j : j + 1], lambda A, B: A.T @ (a.surface_mass @ B))
        q_b, new_b = new_part(Q_b, V_b[:, j : j + 1], lambda A, B: A.T @ (b.surface_mass @ B))
        if min(new_a, new_b) > MIN_COMMON_RATIO * max(new_a, new_b):
            Q_a, Q_b, kept = np.hstack([Q_a, q_a]), np.hstack([Q_b, q_b]), [*kept, j]
    return V_a[:, kept], V_b[:, kept], Q_a, Q_b


def _same_nodes(a: Patch, b: Patch, tolerance: float) -> Index | None:
    """(k,) where the nodes of a stand in b; None if the meshes do not match."""
    if a.points.shape != b.points.shape:
        return None
    distance, order = cKDTree(b.points).query(a.points)
    if distance.max() > tolerance or np.unique(order).size < order.size:
        return None
    return order


def _equal_coordinates(
    one: Marker, other: Marker, order: Index | None
) -> tuple[Array, Array] | None:
    """Rows of the coordinates, if they mean the same on both sides; None otherwise."""
    one_shapes, other_shapes = one.patch.shapes, other.patch.shapes
    if one_shapes is None or other_shapes is None:
        n, k = len(other.hold), other.patch.points.size
        if order is None or n != len(one.hold) or n % k:  # not all nodes turn
            return None
        return one.hold, other.hold.reshape(n // k, k, -1)[:, dofs_of(order)].reshape(n, -1)
    if one.hold.shape[0] != other.hold.shape[0]:
        return None
    if order is None:
        # coefficients of rigid motions agree when the functions do, up to the error of the meshes
        here, there = one.hold[:, :6], other.hold[:, :6]
    else:
        here = one_shapes.reshape(order.size, -1)
        there = other_shapes.reshape(order.size, -1)[order]
    same = np.abs(here - there).max() <= SAME_FUNCTIONS * np.abs(here).max()
    return (one.hold, other.hold) if same else None


def unlike(text: str) -> InterfaceError:
    """The error of two interfaces of unlike coordinates, in a text that says which."""
    hint = "Reduce both with the same kind; on meshes that do not match, with one Polynomial."
    return InterfaceError(f"{text}: they cannot move together.", hint=hint)


def refuse_gap(coupling: Coupling, between: Array, limit: float) -> None:
    """Refuse two places that are farther apart [m] than round-off of their coordinates."""
    gap = float(np.linalg.norm(between))
    if gap > limit:
        text = f"{coupling[0]} and {coupling[1]} lie {gap:.3g} m apart"
        raise InterfaceError(f"{text}; draw bodies in one frame, as they are assembled.")


def _refuse_other_surface(coupling: Coupling, a: Patch, b: Patch) -> None:
    """Surfaces meshed differently still have nearly one centroid and one area."""
    extent = max(np.ptp(a.points, axis=0).max(), np.ptp(b.points, axis=0).max())
    weights = [np.asarray(p.surface_mass.sum(axis=1)).ravel() for p in (a, b)]
    centres = [w @ p.points / w.sum() for w, p in zip(weights, (a, b), strict=True)]
    refuse_gap(coupling, centres[0] - centres[1], SAME_SURFACE[0] * extent)
    areas = [w.sum() for w in weights]
    if abs(areas[0] - areas[1]) > SAME_SURFACE[1] * max(areas):
        text = f"{coupling[0]} has an area of {areas[0]:.4g}, {coupling[1]} of {areas[1]:.4g}"
        raise InterfaceError(f"{text}: they do not cover one surface; name it on both bodies.")


def rows_of_parts(bodies: Mapping[str, Any]) -> list[Row]:
    """The lines of the certificates of all bodies, each with the name of its body in front."""
    return [
        replace(line, quantity=f"{name}: {line.quantity}")
        for name, body in bodies.items()
        for line in (MISSING_ROWS if body.certificate is None else body.certificate.rows)
    ]
