"""Quality gates on the records: is this model, this body, fit to be trusted?"""

import numpy as np
from scipy.linalg import eigvalsh

from rom.arguments import typed
from rom.body.flexible import FlexibleBody
from rom.body.reference import marker_motion, reference_motion, rigid_elastic, rigid_mass
from rom.eigen.verbs import given_rigid_motions
from rom.errors import ConfigError
from rom.model import Array, FEModel, Report, Row
from rom.reduction.full_model import mesh_operators
from rom.rows import row


@typed
def check(record: object) -> Report:
    """Check an `FEModel`, or a `FlexibleBody` with its certificate, against the limits of its kind.

    Raises:
        ConfigError: if there is nothing to check on this kind of object.
    """
    if isinstance(record, FlexibleBody):
        return check_body(record)
    if isinstance(record, FEModel):
        return check_model(record)
    raise ConfigError(
        f"check got a {type(record).__name__}.", hint="It knows FEModel and FlexibleBody."
    )


def check_model(model: FEModel) -> Report:
    """Rigid-body residuals, symmetry and mass of a full model; collective under mpirun.

    Raises:
        ConfigError: if stiffness and mass are not square matrices of one size.
        ModelError: if its operators were made without geometry.
    """
    ops = mesh_operators(model)
    R = given_rigid_motions(ops)
    x = np.sin(np.arange(ops.first, ops.first + ops.n_local) + 1.0)[:, None]
    Kx, KR, J = ops.apply_K(x), ops.apply_K(R), ops.gram(R, ops.apply_M(R))
    scale = np.sqrt(ops.gram(Kx, Kx)[0, 0] / ops.gram(x, x)[0, 0])
    forces, span = (np.sqrt(np.diag(ops.gram(X, X))) for X in (KR, R))
    mass = np.diag(J)[:3]
    rows = (
        row("stiffness against rigid motion", (forces / (span * scale)).max(), 1e-10),
        row("mass equal along x, y, z", np.ptp(mass) / mass.max(), 1e-10),
        row("smallest principal inertia [kg m^2]", _central_inertia(J)[0], 0.0, above=True),
        row("mass [kg]", model.mass(), 0.0, above=True),
    )
    return Report("finite element model", rows)


def _central_inertia(J: Array) -> Array:
    """Principal moments about the mass centre from the (6, 6) rigid mass."""
    coupling = J[:3, 3:]
    return np.linalg.eigvalsh(J[3:, 3:] - coupling.T @ coupling / J[0, 0])


def check_body(body: FlexibleBody) -> Report:
    """Finite numbers, definiteness, symmetry and consistency of the integrals of a body."""
    arrays = (body.S, body.Ibar_kl, body.S_kl, body.K, body.D, body.inertia, body.first_moment)
    finite = all(np.isfinite(A).all() for A in arrays)
    rows = [Row("numbers that are not finite", float(not finite), "== 0", finite)]
    if finite:
        rows += _body_rows(body)
    if body.certificate is not None:
        rows += list(body.certificate.rows)
    return Report(f"body {body.name}", tuple(rows))


def _body_rows(body: FlexibleBody) -> list[Row]:
    lam, least = np.linalg.eigvalsh(body.K), np.linalg.eigvalsh(body.M)[0]
    stiffest, (whole, _) = np.abs(lam).max(), body.full_matrices()
    scale = 1 / np.sqrt(np.maximum(np.diag(whole), 1e-300))
    apart = np.linalg.eigvalsh(scale[:, None] * whole * scale)[0]
    small, middle, large = _central_inertia(rigid_mass(body))
    squares = eigvalsh(body.K, body.M) if least > 0 else np.array(np.nan)
    detuned = np.abs(squares - body.omega**2).max() / np.abs(squares).max()
    # of momentum |int rho phi| over sqrt(m int rho phi^2): above one the integrals cannot be real
    momentum = np.linalg.norm(rigid_elastic(body)[:3], axis=0)
    bound = (momentum / np.sqrt(body.mass * np.diag(body.M))).max()
    damping = np.linalg.eigvalsh(body.D)[0], -1e-9 * stiffest**0.5
    swapped = body.S_kl.transpose(1, 0, 3, 2)
    return [
        row("mass [kg]", body.mass, 0.0, above=True),
        row("smallest principal inertia [kg m^2]", small, 0.0, above=True),
        row("triangle rule of principal inertias", large / (small + middle), 1 + 1e-9),
        row("asymmetry of K", _gap(body.K, body.K.T), 1e-12),
        row("asymmetry of D", _gap(body.D, body.D.T), 1e-12),
        row("asymmetry of the inertia integrals", _gap(body.S_kl, swapped), 1e-12),
        row("smallest over largest stiffness", lam[0] / stiffest, 0.0, above=True),
        row("frequencies of the coordinates against stiffness and mass", detuned, 1e-6),
        row("smallest damping", *damping, above=True),
        row("smallest eigenvalue of M", least, 0.0, above=True),
        row("frame and shapes together: smallest scaled mass", apart, 1e-12, above=True),
        row("momentum of the shapes within Schwarz' bound", bound, 1 + 1e-9),
        *_marker_rows(body),
    ]


def _gap(A: Array, B: Array) -> float:
    return float(np.abs(A - B).max() / max(np.abs(A).max(), 1e-300))


def _marker_rows(body: FlexibleBody) -> list[Row]:
    """Interfaces of six coordinates move as their markers, and the frame moves with none."""
    size, gaps = np.r_[np.ones(3), np.full(3, body.size)][:, None], [0.0]
    scale = np.r_[1 / size[:, 0], np.full(body.n_modes, np.sqrt(body.mass))]
    for marker in body.markers.values():
        if marker.kind in ("rbe2", "rbe3"):
            moved = np.hstack(marker_motion(marker, body.n_modes))
            gaps.append(np.abs((marker.hold - moved) * size * scale).max())
    rows = [row("coordinates of interfaces against their markers", max(gaps), 1e-6)]
    if body.quartic is None and body.reference in ("mean-axis", "buckens", *body.markers):
        drift = np.abs(reference_motion(body, body.reference) * size).max() * np.sqrt(body.mass)
        rows.append(row("motion of the frame in the shapes", drift, 1e-6))
    return rows
