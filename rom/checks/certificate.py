"""The certificate: what was measured to show that the reduced body stands for the full model."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import eigh, null_space

from rom.body.damping import damping_rows
from rom.body.flexible import FlexibleBody
from rom.body.projection import Elastic
from rom.body.records import Provenance
from rom.body.reference import rigid_mass
from rom.checks.draft import COMPARISON_STAGE, Draft
from rom.eigen.condensed import Condensed, condensed
from rom.eigen.connection import Connection
from rom.eigen.verbs import (
    Operators,
    given_rigid_motions,
    mac,
    quadratic,
    residual_errors,
    unit_motions,
)
from rom.errors import InterfaceError
from rom.model import Array, Basis, Mask, Report, Row
from rom.process.progress import MANY_DOFS, stages
from rom.rows import BELOW_FULL_RTOL, FREQUENCY_RTOL, N_COMPARED, frequency_rows, row

# Relative to the diagonals it bounds the error of squared frequencies; round-off of a fine mesh on
# rbe3 interfaces reaches 3e-9, a wrong matrix is asymmetric by per cents.
ASYMMETRY_RTOL = 1e-6
MIN_JUDGED_ERROR = 1e-6  # frequency error above which the estimate is compared with it
MAX_ERROR_RATIO = 2.0  # frequency error over its estimate
ROUND_OFF = 1e-9  # Rayleigh quotient, of the largest one of a basis, that is none
SHAPES_RATIO = 10.0  # round-off of the energy of shapes over that of rigid motions, at most
CLUSTER_RTOL = 1e-3  # relative distance of modes that are compared as one subspace


def certify(draft: Draft) -> None:
    """Compare a reduced body with the full model it came from: a stage of a reduction.

    Full modes are found in every support where they cost no more than the reduction, or the draft
    asks for them; else those of the free body, and estimates go for the others. The provenance of
    the body then has a "comparison", {support: {"reduced": [Hz], "estimated": [relative errors],
    "full": [Hz], "mac": []}}; the last two are empty where full modes cost too much, and the
    estimates where the method has none.
    """
    draft.watch.begin(COMPARISON_STAGE)
    connection, ops, body, basis = draft.connection, draft.ops, draft.body, draft.basis
    draft.say("compare the reduced body with the full model")
    rows, static, comparison = list[Row](), list[Row](), {}
    matrices, statics = basis_matrices(connection.ops, basis), body.has_static_shapes
    supports: list[tuple[str, ...]] = [(), *((name,) for name in connection.parts if statics)]
    n_b = len(connection.labels)
    constrained = basis.labels[:n_b] == connection.labels
    parts = condensed_model(connection, basis, matrices[0]) if statics and constrained else None
    known = connection.ops.comparison_pays(len(supports), n_b, basis.Psi.shape[1] - n_b)
    known = known or draft.certify == "full" or parts is None or not _estimable(basis)
    with stages(len(supports), long=ops.n > MANY_DOFS) as begin:
        for fixed in supports:
            support = " + ".join(fixed) + " held" if fixed else "free"
            begin(f"compare with the full model, {support}")
            full = connection.ops.affordable and (known or not fixed)
            loaded = fixed == tuple(connection.parts)[:1] and len(connection.parts) > 1
            held: Any = full_support(connection, parts, fixed) if full or loaded else None
            if loaded:
                held = connection.ops.hold(held) if isinstance(held, np.ndarray) else held
                static = _static_row(connection, body, held)
            reduction = basis, parts, matrices
            table = compared(connection, ops, body, reduction, fixed, held if full else None)
            if table["reduced"]:
                comparison[support] = table
    if not connection.ops.affordable:
        rows.append(Row("dofs; full modes are too dear, errors estimated", ops.n, "--", True))
    elif not known:
        words = "supports estimated only; full modes cost more than the reduction"
        rows.append(Row(words, len(supports) - 1, "--", True))
    rigid = rigid_rows(ops, body, draft.elastic)
    for support, table in comparison.items():
        if table["full"]:
            # round-off is the energy of rigid motions over that of the first mode; a slender body
            # that is held bends with far less than when it is free
            softer = (body.omega[0] / (2 * np.pi * min(table["full"]))) ** 2
            round_off = max(BELOW_FULL_RTOL, float(SHAPES_RATIO * rigid[-1].value * softer))
            rows += frequency_rows(support, table, round_off=round_off)
        rows += _estimate_rows(support, table)
    rows += [*static, *rigid, *_matrix_rows(connection, basis, body, matrices)]
    rows += _effective_mass(body, tuple(connection.parts)) if statics else []
    rows += damping_rows(body, N_COMPARED)
    if (n := draft.model.n_scalars) > 0:  # then the full model is itself reduced
        shares = draft.E * draft.bare.apply_M(draft.E)
        words = "full is the superelement given; most of a mode's mass without a place"
        share = float((shares[-n:].sum(axis=0) / shares.sum(axis=0)).max(initial=0.0))
        rows.append(Row(words, share, "information", True))
    report = Report(f"certificate of {body.name}", (*rows, *draft.rows))
    attach(draft, report, comparison, f"body {draft.name!r}")


def attach(draft: Draft, report: Report, comparison: Provenance, of: str) -> None:
    """Give a body its certificate, and warn of what fails in it."""
    report.warn_of_failures(f"the certificate of {of}")
    provenance = draft.body.provenance | {"comparison": comparison}
    draft.body = replace(draft.body, certificate=report, provenance=provenance)


def compared(
    connection: Connection,
    ops: Operators,
    body: FlexibleBody,
    reduction: tuple[Basis, Condensed | None, tuple[Array, Array]] | None,
    fixed: tuple[str, ...],
    support: Any,
) -> dict[str, list[float]]:
    """Frequencies of both models with interfaces fixed, their errors, and the agreement of shapes.

    The reduction is its basis, the full model condensed to the interfaces where that is known, and
    stiffness and mass of the basis; None for frequencies alone. Support is what `full_support` has
    for the full model; None to estimate only.
    """
    omega_r = body.modes(fixed=fixed)[0]
    n_rigid = int(np.count_nonzero(omega_r == 0.0))
    n = min(N_COMPARED, omega_r.size - n_rigid)
    table: dict[str, list[float]] = {"full": [], "reduced": [], "mac": [], "estimated": []}
    if n <= 0 or n_rigid not in (0, 6):
        return table
    table["reduced"] = (omega_r[n_rigid : n_rigid + n] / (2 * np.pi)).tolist()
    Phi = None
    if support is not None:
        omega, Phi = connection.ops.modes(support, n + n_rigid, finished=True)
        table["full"] = (omega[n_rigid:] / (2 * np.pi)).tolist()
    if reduction is None:
        return table
    # the reduced shapes again, as combinations of the columns of the basis
    basis, parts, matrices = reduction
    shapes = reduced_shapes(connection, basis, fixed, n + n_rigid, matrices)
    if parts is not None and _estimable(basis):
        found = residual_errors(connection.ops, parts.held, shapes[:, n_rigid:])
        table["estimated"] = found.tolist()
    if Phi is not None:
        Phi, shapes = (connection.ops.expand(X) for X in (Phi[:, n_rigid:], shapes))
        shares = mac(ops, Phi, shapes)
        best = omega_r[np.argmax(shares, axis=1)][:, None]
        # modes of nearly one frequency may rotate among themselves: they count together
        near = np.abs(omega_r[: n + n_rigid] - best) <= CLUSTER_RTOL * best
        table["mac"] = np.minimum((shares * near).sum(axis=1), 1.0).tolist()
    return table


def _estimable(basis: Basis) -> bool:
    """Whether errors follow from residuals: constraint modes leave none on the interfaces.

    One inverse then serves every support.
    """
    return not any(label.startswith("enhanced") for label in basis.labels)


def condensed_model(connection: Connection, basis: Basis, K: Array) -> Condensed:
    """The full model condensed to its interfaces, by the stiffness K (r, r) of the basis.

    Its columns of the interfaces come first, and its ``held`` is of this very model.
    """
    boundary, n_b = connection.boundary, connection.boundary.size
    held = basis.held if basis.held is not None else connection.ops.hold(boundary)
    return condensed(connection.ops, held, boundary, basis.Psi[:, :n_b], K[:n_b, :n_b])


def basis_matrices(ops: Operators, basis: Basis) -> tuple[Array, Array]:
    """(r, r) stiffness and mass of the basis as they come, not made symmetric."""
    return quadratic(ops, ops.apply_K, basis.Psi), quadratic(ops, ops.apply_M, basis.Psi)


def full_support(connection: Connection, parts: Condensed | None, fixed: tuple[str, ...]) -> Any:
    """The full model in one support: dof numbers, or what solves for it without a new factor."""
    dofs = connection.held(fixed)
    try:
        return dofs if parts is None else parts.support(dofs)
    except InterfaceError:  # a motion without stiffness, which the whole body names better
        return dofs


def reduced_shapes(
    connection: Connection,
    basis: Basis,
    fixed: tuple[str, ...],
    n: int,
    matrices: tuple[Array, Array] | None = None,
) -> Array:
    """(n_local, n) shapes of the reduced model, computed from the basis and not from the body.

    Its stiffness and mass are computed where they are not known.
    """
    ops = connection.ops
    K, M = matrices or basis_matrices(ops, basis)
    if basis.labels[: len(connection.labels)] == connection.labels:
        keep = np.setdiff1d(np.arange(basis.Psi.shape[1]), connection.held_parts(fixed))
        Psi, K, M = basis.Psi[:, keep], K[np.ix_(keep, keep)], M[np.ix_(keep, keep)]
    else:  # modes alone: the combinations that keep the supports still
        rows = ops.rows(basis.Psi, connection.held(fixed))
        N = null_space(rows, rcond=1e-10) if len(rows) else np.eye(basis.Psi.shape[1])
        Psi, K, M = basis.Psi @ N, N.T @ K @ N, N.T @ M @ N
    scale = 1 / np.sqrt(np.diag(M))
    K, M = (scale[:, None] * (A + A.T) * (0.5 * scale) for A in (K, M))
    _, V = eigh(K, M, subset_by_index=(0, n - 1))
    return Psi @ (scale[:, None] * V)


def _estimate_rows(support: str, table: dict[str, list[float]]) -> list[Row]:
    """The estimates; against the truth where that is known and more than round-off."""
    if not table["estimated"]:
        return []
    estimate = np.array(table["estimated"])
    what = f"{support}: estimated error of {estimate.size} frequencies"
    worst = row(what, estimate.max(), FREQUENCY_RTOL)
    if not table["full"]:
        return [worst]
    error = np.array(table["reduced"]) / np.array(table["full"]) - 1
    ratio = (error / np.maximum(estimate, MIN_JUDGED_ERROR)).max()
    return [worst, row(f"{support}: largest error over its estimate", ratio, MAX_ERROR_RATIO)]


def _static_row(connection: Connection, body: FlexibleBody, held: Any) -> list[Row]:
    """Deflection under unit loads on the other interfaces, the first one held; exact for CB."""
    names = tuple(connection.parts)
    ops, first = connection.ops, names[0]
    loaded = connection.held(names[1:])
    full = ops.rows(held(unit_motions(ops, loaded)), loaded)
    H, G = body.marker(first).hold, np.vstack([body.marker(name).hold for name in names[1:]])
    rigid = np.linalg.lstsq(H[:, :6], -H[:, 6:], rcond=None)[0]
    motion = G[:, :6] @ rigid + G[:, 6:]
    if np.abs(H[:, :6] @ rigid + H[:, 6:]).max() > 1e-9 * np.abs(H[:, 6:]).max():
        return []  # the first interface deforms: its frame does not follow a rigid motion
    reduced = motion @ np.linalg.solve(body.K, motion.T)
    diagonal = np.sqrt(np.diag(full))
    error = np.abs((reduced - full) / np.outer(diagonal, diagonal)).max()
    return [row(f"{first} held: static flexibility of the interfaces", error, 1e-6)]


def rigid_rows(ops: Operators, body: FlexibleBody, elastic: Elastic) -> list[Row]:
    """Rigid motions of the body against those of the full model, their energy in the last row."""
    R = given_rigid_motions(ops)
    K, M = (ops.gram(R, apply(R)) for apply in (ops.apply_K, ops.apply_M))
    size = np.r_[np.ones(3), np.full(3, body.size)]
    weight = body.mass * np.outer(size, size)
    apart = np.abs((rigid_mass(body) - M) / weight).max()
    energy = np.abs(K / weight).max() / (body.omega[0] ** 2 if body.omega.size else 1.0)
    return [
        row("mass, centre, inertia: body against full", apart, 1e-9),
        row("rigid motions inside the basis", elastic.residual, 1e-8),
        row("energy of rigid motions, over the first mode", energy, 1e-6),
    ]


def _matrix_rows(
    connection: Connection, basis: Basis, body: FlexibleBody, matrices: tuple[Array, Array]
) -> list[Row]:
    K, M = matrices
    quotient = np.diag(K) / np.diag(M)
    stiff = quotient > ROUND_OFF * quotient.max()  # a rigid column has no stiffness of its own
    asymmetry = max(_asymmetry(K[stiff][:, stiff]), _asymmetry(M))
    scale = 1 / np.sqrt(np.diag(M))
    lam = np.linalg.eigvalsh(scale[:, None] * (0.5 * (M + M.T)) * scale)
    return [
        *_coupling_row(connection, basis, K, stiff),
        row("asymmetry of projected K and M", asymmetry, ASYMMETRY_RTOL),
        row("smallest eigenvalue of the scaled mass", lam[0], 1e-13, above=True),
        row("condition of the scaled mass", lam[-1] / max(lam[0], 1e-300), 1e13),
        row("mass-normalised shapes", np.abs(body.M - np.eye(body.n_modes)).max(initial=0.0), 1e-8),
        row("lowest elastic frequency [Hz]", body.omega[0] / (2 * np.pi), 0.0, above=True),
    ]


def _coupling_row(connection: Connection, basis: Basis, K: Array, stiff: Mask) -> list[Row]:
    """Constraint modes and fixed-interface modes do not couple in K; other modes do.

    Constraint modes of a single interface are rigid motions, whose stiffness is round-off.
    """
    normal = [label.startswith("fixed-interface") for label in basis.labels]
    n_b = normal.index(True) if any(normal) else 0
    if not any(normal) or not all(normal[n_b:]) or n_b > connection.boundary.size:
        return []
    b, size = np.flatnonzero(stiff[:n_b]), np.sqrt(np.abs(np.diag(K)))
    coupling = np.abs(K[b, n_b:] / np.outer(size[b], size[n_b:])).max(initial=0.0)
    return [row("constraint against normal modes in K", coupling, 1e-8)]


def _asymmetry(A: Array) -> float:
    scale = np.sqrt(np.abs(np.diag(A)))
    scale[scale == 0] = 1.0
    return float(np.abs((A - A.T) / np.outer(scale, scale)).max())


def _effective_mass(body: FlexibleBody, names: tuple[str, ...]) -> list[Row]:
    """Share of the mass that the kept modes carry when the supports shake; for information."""
    supports = {f"{names[0]} held": names[:1], "all interfaces held": names}
    masses = {at: body.effective_mass(fixed=of)[:, :3].sum(axis=0) for at, of in supports.items()}
    return [
        Row(f"{at}: effective mass along {axis}", float(share), "information", True)
        for at, mass in masses.items()
        for axis, share in zip("xyz", mass / body.mass, strict=True)
    ]
