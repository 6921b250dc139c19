"""How far to trust a family: errors estimated as it grows, and compared where it was not made."""

from dataclasses import replace
from typing import Any

import numpy as np

from rom.body.flexible import FlexibleBody
from rom.body.projection import elastic_part
from rom.checks.certificate import (
    basis_matrices,
    compared,
    condensed_model,
    full_support,
    reduced_shapes,
    rigid_rows,
)
from rom.components.families.affine import AffineModel
from rom.components.families.family import BodyFamily
from rom.components.families.parameters import scattered
from rom.eigen.verbs import residual_errors
from rom.model import Basis, Report, Row
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.records import Connection
from rom.rows import N_COMPARED, frequency_rows, row

HELD_OUT = 3  # points of the certificate


def _supports(connection: Connection) -> list[tuple[str, ...]]:
    return [(), *((name,) for name in connection.parts)]


def estimated(connection: Connection, basis: Basis) -> float:
    """The largest estimated error of the first frequencies, free and on each interface."""
    ops, worst = connection.ops, 0.0
    inner = ops.hold(connection.boundary)
    for fixed in _supports(connection):
        n_rigid = 0 if fixed else 6
        held = sum(connection.parts[name].size for name in fixed)
        n = min(N_COMPARED, basis.Psi.shape[1] - held - n_rigid)
        if n > 0:
            shapes = reduced_shapes(connection, basis, fixed, n + n_rigid)[:, n_rigid:]
            worst = max(worst, float(residual_errors(ops, inner, shapes).max()))
    return worst


def certified(
    affine: AffineModel,
    family: BodyFamily,
    connection: Connection,
    basis: Basis,
    interfaces: dict[str, Any],
    tol: float,
    *,
    first: int,
) -> tuple[Report, dict[str, Any]]:
    """Bodies of a family against full models, at points that were not sampled."""
    rows: list[Row] = []
    comparison: dict[str, Any] = {}
    Psi, own = connection.ops.expand(basis.Psi), replace(basis, held=None)  # of another point
    for point in scattered(affine.parameters, HELD_OUT, first):
        where = ", ".join(f"{name} = {value:.4g}" for name, value in point.items())
        ops, body = affine.at(point), family.at(extrapolate=False, **point)
        here = connect(ops, affine.model_at(point), interfaces)
        found: list[Row] = []
        parts = matrices = None
        if affine.stretch is None:
            matrices = basis_matrices(here.ops, basis)
            parts = condensed_model(here, own, matrices[0])
        for fixed in _supports(here):
            if parts and matrices:
                support = full_support(here, parts, fixed)
                table = compared(here, ops, body, (basis, parts, matrices), fixed, support)
            else:
                table = _frequencies(here, body, fixed)
            if not table["reduced"]:
                continue
            words = " + ".join(fixed) + " held" if fixed else "free"
            comparison[f"{where}: {words}"] = table
            if table["full"]:
                found += frequency_rows(words, table, tol)
            elif table["estimated"]:
                label = f"{words}: estimated error of {len(table['reduced'])} frequencies"
                found.append(row(label, max(table["estimated"]), tol))
        found += rigid_rows(ops, body, elastic_part(ops, Psi))
        rows += [replace(line, quantity=f"{where}: {line.quantity}") for line in found]
    return Report(f"certificate of the family {family.body.name}", tuple(rows)), comparison


def _frequencies(
    connection: Connection, body: FlexibleBody, fixed: tuple[str, ...]
) -> dict[str, list[float]]:
    """Frequencies of both models in one support, as `compared` gives them, without shapes."""
    omega = body.modes(fixed=fixed)[0]
    n_rigid = int(np.count_nonzero(omega == 0.0))
    n = min(N_COMPARED, omega.size - n_rigid)
    table: dict[str, list[float]] = {"full": [], "reduced": [], "mac": [], "estimated": []}
    if n > 0 and connection.ops.affordable:
        full, _ = connection.ops.modes(connection.held(fixed), n + n_rigid)
        table["full"] = (full[n_rigid:] / (2 * np.pi)).tolist()
        table["reduced"] = (omega[n_rigid : n_rigid + n] / (2 * np.pi)).tolist()
    return table
