"""How far to trust a family: errors estimated as it grows, and compared where it was not made."""

from dataclasses import dataclass, replace
from typing import Any

from rom.body.projection import elastic_part
from rom.checks.certificate import (
    attach,
    basis_matrices,
    compared,
    condensed_model,
    full_support,
    reduced_shapes,
    rigid_rows,
)
from rom.checks.draft import COMPARISON_STAGE, Draft
from rom.components.families.affine import AffineModel
from rom.components.families.parameters import Point, scattered
from rom.eigen.verbs import residual_errors
from rom.model import Basis, Report, Row
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.records import Connection
from rom.rows import N_COMPARED, frequency_rows, row

HELD_OUT = 3  # points of the certificate


@dataclass(kw_only=True)
class FamilyDraft(Draft):
    """The reduction of a family under way; its model is that at the centre of the ranges.

    Attributes:
        affine: the model at all points.
        tol: error of frequencies that is accepted [1].
        samples: points whose bases have joined.
        n_trials: number of points at which errors were estimated as the basis grew.
    """

    affine: AffineModel
    tol: float
    samples: list[Point]
    n_trials: int = 0


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


def certify(draft: FamilyDraft) -> None:
    """Compare bodies of the family with full models, at points that were not sampled."""
    draft.watch.begin(COMPARISON_STAGE)
    affine, family, basis, kinds = draft.affine, draft.body, draft.basis, draft.interfaces
    if affine.stretch is not None:  # its interfaces are rigid at each thickness in another way
        kinds = dict.fromkeys(kinds, "rbe2")
    rows: list[Row] = []
    comparison: dict[str, Any] = {}
    own = replace(basis, held=None)  # of another point
    for point in scattered(affine.parameters, HELD_OUT, 1 + draft.n_trials):
        where = ", ".join(f"{name} = {value:.4g}" for name, value in point.items())
        ops, body = affine.at(point), family.at(extrapolate=False, **point)
        here = connect(ops, affine.model_at(point), kinds)
        found: list[Row] = []
        reduction: Any = None  # the basis of a stretched body depends on the thickness
        if affine.stretch is None:
            matrices = basis_matrices(here.ops, basis)
            reduction = basis, condensed_model(here, own, matrices[0]), matrices
        for fixed in _supports(here):
            known = reduction is not None or here.ops.affordable
            support = full_support(here, reduction and reduction[1], fixed) if known else None
            table = compared(here, ops, body, reduction, fixed, support)
            if not table["reduced"]:
                continue
            words = " + ".join(fixed) + " held" if fixed else "free"
            comparison[f"{where}: {words}"] = table
            if table["full"]:
                found += frequency_rows(words, table, draft.tol)
            elif table["estimated"]:
                label = f"{words}: estimated error of {len(table['reduced'])} frequencies"
                found.append(row(label, max(table["estimated"]), draft.tol))
        found += rigid_rows(ops, body, elastic_part(ops, draft.Psi))
        rows += [replace(line, quantity=f"{where}: {line.quantity}") for line in found]
    report = Report(f"certificate of the family {family.body.name}", tuple(rows))
    attach(draft, report, comparison, f"family {draft.name!r}")
