"""From a basis to a flexible body: rigid motions out, integrals, markers, surface."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.sparse import csr_matrix

from rom.body.flexible import FlexibleBody
from rom.body.frame import mode_labels
from rom.body.inertia import (
    InertiaIntegrals,
    fields_of,
    inertia_integrals,
    point_integrals,
    turning_integrals,
)
from rom.body.nonlinear.cauchy import CauchyRecovery
from rom.body.records import Marker, Patch, Provenance, Surface
from rom.body.recovery import StressRecovery, with_elements
from rom.eigen.attachments import carried_displacements
from rom.eigen.connection import Tie
from rom.eigen.verbs import (
    Operators,
    dofs_of,
    given_rigid_motions,
    massless,
    mean_motion,
    modes_within,
    orthonormal,
    own_points,
    quadratic,
)
from rom.errors import ModelError
from rom.model import Array, FEModel, Index, Interface

NEGATIVE_STIFFNESS_RTOL = 1e-9  # of the largest eigenvalue of K; round-off is smaller
MASSLESS_RTOL = 1e-9  # energy of a motion without mass, of the stiffest column's
RIGID_RESIDUAL = 1e-6  # relative distance of a rigid motion from the basis that is still accepted


@dataclass(frozen=True, slots=True)
class Elastic:
    """The part of a basis without rigid motion."""

    V: Array  # (r + 6, r) combinations of the basis columns: free-free modes of the reduced model
    omega: Array  # (r,) their circular frequencies [rad/s]
    rigid: Array  # (r + 6, 6) combinations that give the six rigid motions
    residual: float  # distance of the rigid motions from the basis, relative


def elastic_part(ops: Operators, Psi: Array, labels: Sequence[str]) -> Elastic:
    """Split the span of Psi into rigid motions and mass-normalised free-free modes."""
    M, K = quadratic(ops, ops.apply_M, Psi), quadratic(ops, ops.apply_K, Psi)
    if not (least := np.diag(M)).min() > 0.0:
        raise massless(repr(labels[int(least.argmin())]))
    scale = 1 / np.sqrt(least)
    M, K = (scale[:, None] * A * scale for A in (M, K))
    M, K = (0.5 * (A + A.T) for A in (M, K))
    mu, V = np.linalg.eigh(M)
    if mu[0] < 1e-13:
        if V[:, 0] @ K @ V[:, 0] > MASSLESS_RTOL * np.diag(K).max():
            raise massless(repr(labels[int(np.abs(V[:, 0]).argmax())]))
        text = "the basis has columns that depend on each other"
        raise ModelError(f"{text}; ask for fewer modes, or name each interface once.")
    R = orthonormal(ops, given_rigid_motions(ops))
    B = np.linalg.solve(M, scale[:, None] * ops.gram(Psi, ops.apply_M(R)))
    gap = R - Psi @ (scale[:, None] * B)
    residual = float(np.sqrt(np.diag(ops.gram(gap, ops.apply_M(gap))).max()))
    if residual > RIGID_RESIDUAL:
        text = f"the basis misses a rigid motion by {residual:.1e}"
        raise ModelError(f"{text}; hold interfaces that stop all, or add rigid modes to the basis.")
    lam, V = modes_within(null_space(B.T @ M), K, M)
    if negative := np.count_nonzero(lam < -NEGATIVE_STIFFNESS_RTOL * lam.max(initial=0.0)):
        text = f"{negative} shapes have negative stiffness: without its supports it would buckle"
        raise ModelError(f"{text}; heat it less, or take rom.modes with its supports held.")
    return Elastic(scale[:, None] * V, np.sqrt(np.maximum(lam, 0.0)), scale[:, None] * B, residual)


def flexible_body(
    model: FEModel,
    ops: Operators,
    E: Array,
    omega: Array,
    *,
    ties: dict[str, Tie],
    name: str,
    provenance: Provenance,
) -> FlexibleBody:
    """The body of mass-normalised nodal shapes E (n_local, r), by operators of the mesh alone."""
    if model.n_dofs > model.points.size:
        integrals = turning_integrals(model, ops, E)
    else:
        integrals = inertia_integrals(ops, own_points(ops, model.points), E)
    surface = None
    if (mesh := model.surface) is not None:
        shape = ops.rows(E, dofs_of(mesh.nodes))
        surface = Surface(model.points[mesh.nodes], mesh.triangles, shape)
    return FlexibleBody(
        name=name,
        **fields_of(sum(carried_integrals(model, ops, E), integrals)),
        K=np.diag(omega**2),
        D=np.zeros((omega.size, omega.size)) if model.D is None else E.T @ model.D @ E,
        markers={n: _marker(ops, model.interfaces[n], tie, E) for n, tie in ties.items()},
        omega=omega,
        labels=mode_labels(omega.size, "mean-axis"),
        surface=surface,
        provenance=provenance,
    )


def canonical_columns(ops: Operators, E: Array, model: FEModel) -> Array:
    """Turn the sign of each shape by a measure that does not depend on the numbering of nodes."""
    x = model.points - model.points.mean(axis=0)
    x = own_points(ops, x) / np.abs(x).max()
    a, b, c = x.T
    weight = np.column_stack(
        [1.0 + a + 0.7 * b**2 - c**3, 0.9 - b + 0.8 * c**2 + a**3, 0.8 + c - 0.6 * a**2 + b**3]
    )
    field = np.zeros((ops.n_local, 1))
    field[: weight.size, 0] = weight.ravel()
    sign = np.sign(ops.gram(ops.apply_M(field), E))[0]
    return E * np.where(sign == 0, 1.0, sign)


def carried_integrals(model: FEModel, ops: Operators, E: Array) -> list[InertiaIntegrals]:
    """Integrals of what each attachment carries, under shapes E (n_local, r)."""
    carried = (carried_displacements(attachment, model) for attachment in model.attachments)
    moved = ((c, c.N @ ops.rows(E, c.interface.dofs)) for c in carried)
    return [point_integrals(c.points, c.masses, shapes) for c, shapes in moved]


def _marker(ops: Operators, interface: Interface, tie: Tie, E: Array) -> Marker:
    U = ops.rows(E, interface.dofs)
    motion = mean_motion(interface) @ U
    hold = np.hstack([tie.coordinates @ interface.rigid_motions(), tie.coordinates @ U])
    patch = None
    if tie.label not in ("rbe2", "rbe3"):  # its coordinates let the surface deform
        shapes = csr_matrix(tie.by_masters).toarray() if tie.removed.size else None
        patch = Patch(interface.points, csr_matrix(interface.surface_mass), shapes)
    return Marker(interface.name, interface.origin, motion[:3], motion[3:], tie.label, hold, patch)


def stress_recovery(model: FEModel, E: Array, missing: Array | None = None) -> StressRecovery:
    """Stress of shapes E (n_local, r), and of missing ones, see `rom.body.recovery`."""
    nodes = stressed_nodes(model)
    shapes = E if missing is None else np.hstack([E, missing])
    operator = model.stresses.at_nodes(shapes, nodes).reshape(6 * nodes.size, -1)
    inertial = None if missing is None else operator[:, E.shape[1] :]
    return StressRecovery(model.points[nodes], operator[:, : E.shape[1]], inertial)


def cauchy_recovery(model: FEModel, E: Array) -> CauchyRecovery:
    """Stress on the surface at large deflection, of nodal displacements E (n_local, r)."""
    nodes = stressed_nodes(model)
    return CauchyRecovery(model.points[nodes], **model.stresses.gradients_at_nodes(E, nodes))


def stressed_nodes(model: FEModel) -> Index:
    """(p,) nodes of the surface, at which stress is recovered."""
    return with_elements(model, "stress", ", or reduce with stress=False").nodes
