"""Quality gates on the records: is this model, this body, fit to be trusted?"""

from typing import Any

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
def check(record: Any) -> Report:
    """Check a record against the limits its kind has to meet.

    Args:
        record: an `FEModel`, or a `FlexibleBody` (its certificate is part of the report).

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
    ops: Any = mesh_operators(model)
    R = given_rigid_motions(ops)
    KR, MR = ops.apply_K(R), ops.apply_M(R)
    x = np.sin(np.arange(ops.first, ops.first + ops.n_local) + 1.0)[:, None]
    Kx = ops.apply_K(x)
    scale = np.sqrt(_square(ops, Kx) / _square(ops, x))
    span = np.sqrt(np.diag(ops.gram(R, R)))
    J = ops.gram(R, MR)
    mass = np.diag(J)[:3]
    return Report(
        "finite element model",
        (
            row("stiffness against rigid motion", _rigid_residual(ops, KR, span, scale), 1e-10),
            row("mass equal along x, y, z", np.ptp(mass) / mass.max(), 1e-10),
            row("smallest principal inertia [kg m^2]", _central_inertia(J)[0], 0.0, above=True),
            row("mass [kg]", model.mass(), 0.0, above=True),
        ),
    )


def _square(ops: Any, x: Array) -> float:
    return float(ops.gram(x, x)[0, 0])


def _rigid_residual(ops: Any, KR: Array, span: Array, scale: float) -> float:
    return float((np.sqrt(np.diag(ops.gram(KR, KR))) / (span * scale)).max())


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
    M, lam = body.M, np.linalg.eigvalsh(body.K)
    whole, _ = body.full_matrices()
    scale = 1 / np.sqrt(np.maximum(np.diag(whole), 1e-300))
    central = _central_inertia(rigid_mass(body))
    return [
        row("mass [kg]", body.mass, 0.0, above=True),
        row("smallest principal inertia [kg m^2]", central[0], 0.0, above=True),
        row(
            "triangle rule of principal inertias", central[2] / (central[0] + central[1]), 1 + 1e-9
        ),
        row("asymmetry of K", _asymmetry(body.K), 1e-12),
        row("asymmetry of D", _asymmetry(body.D), 1e-12),
        row("asymmetry of the inertia integrals", _swapped(body.S_kl), 1e-12),
        row("smallest over largest stiffness", lam[0] / np.abs(lam).max(), 0.0, above=True),
        row("frequencies of the coordinates against stiffness and mass", _detuned(body), 1e-6),
        row(
            "smallest damping",
            np.linalg.eigvalsh(body.D)[0],
            -1e-9 * np.abs(lam).max() ** 0.5,
            above=True,
        ),
        row("smallest eigenvalue of M", np.linalg.eigvalsh(M)[0], 0.0, above=True),
        row(
            "frame and shapes together: smallest scaled mass",
            np.linalg.eigvalsh(scale[:, None] * whole * scale)[0],
            1e-12,
            above=True,
        ),
        row("momentum of the shapes within Schwarz' bound", _schwarz(body), 1 + 1e-9),
        *_marker_rows(body),
    ]


def _detuned(body: FlexibleBody) -> float:
    """Largest difference of the squared frequencies it has from those it says, of the largest."""
    found = eigvalsh(body.K, body.M) if np.linalg.eigvalsh(body.M)[0] > 0 else np.array(np.nan)
    return float(np.abs(found - body.omega**2).max() / np.abs(found).max())


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


def _asymmetry(A: Array) -> float:
    return float(np.abs(A - A.T).max() / max(np.abs(A).max(), 1e-300))


def _swapped(S_kl: Array) -> float:
    other = S_kl.transpose(1, 0, 3, 2)
    return float(np.abs(S_kl - other).max() / max(np.abs(S_kl).max(), 1e-300))


def _schwarz(body: FlexibleBody) -> float:
    """Largest |int rho phi| over sqrt(m int rho phi^2); above one the integrals cannot be real."""
    momentum = np.linalg.norm(rigid_elastic(body)[:3], axis=0)
    return float((momentum / np.sqrt(body.mass * np.diag(body.M))).max())
