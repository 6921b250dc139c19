"""The short road for parameters: one reduction for a range of them."""

import logging
from dataclasses import replace
from typing import Any

import numpy as np

from rom.arguments import between, typed
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.projection import stress_recovery
from rom.checks.draft import Stage, run, wanted
from rom.components.families.affine import AffineModel
from rom.components.families.common_basis import first_sample
from rom.components.families.evidence import FamilyDraft, certify, estimated
from rom.components.families.family import BodyFamily
from rom.components.families.parameters import (
    Parameter,
    Point,
    Thickness,
    centre,
    checked_parameters,
    corners,
    scattered,
    written,
)
from rom.components.families.stretched import StretchedModel
from rom.errors import ParameterError
from rom.model import FEModel
from rom.names import check_name
from rom.reduction.bases.method import Method
from rom.reduction.interfaces.characteristic import Characteristic
from rom.reduction.interfaces.connection import connect as connected
from rom.stages.bodies import connect, few_functions, make_body, place_frame, project

log = logging.getLogger("rom")
SHAPE_RATIO = 0.1  # of the square root of the tolerance: a shape dropped costs its square in energy
TRIALS_PER_PARAMETER = 2  # points at which errors are estimated while the basis grows
METHOD_ERROR_FACTOR = 2.0  # times the error at the centre, which more points do not reduce


@typed
def reduce_parametric(  # noqa: PLR0913  one keyword per choice
    model: FEModel,
    *,
    parameters: dict[str, Parameter],
    method: Method | Characteristic,
    interfaces: dict[str, Any],
    reference: Any = "mean-axis",
    damping: Rayleigh | ModalDamping | None = None,
    name: str = "body",
    stress: bool = False,
    tol: float = 1e-3,
    certify: bool = True,
) -> BodyFamily:
    """Flexible bodies for a range of moduli, densities and thicknesses, from one reduction.

    Bases at the centre and the corners of the ranges join into one; where the estimated error of a
    frequency exceeds the tolerance at a point between, the basis of that point joins too.

    Args:
        model: the full model, free-free, at factors of one.
        parameters: {name: `YoungsModulus`, `Density` or `Thickness`}; with a thickness all
            interfaces are "rbe2", nothing hangs on them, and stress is not recovered.
        method: how to reduce at one point; one that keeps interface coordinates, for example
            ``CraigBampton(n_modes=20)``.
        interfaces: {name: kind}, see `rom.reduce`.
        reference: how the floating frame follows the bodies, see `FlexibleBody.with_reference`.
        damping: structural damping, made anew at every point.
        name: name of the bodies.
        stress: make the stress on the outer surface recoverable.
        tol: relative error of the first frequencies that is accepted [1]; where the method alone
            has nearly as much at the centre, more points are no cure.
        certify: compare with full models at points that were not sampled.

    Returns:
        BodyFamily; ``family.at(name=factor)`` is a `FlexibleBody`.

    Raises:
        ParameterError: for a wrong parameter or an unknown region.
        InterfaceError, ConfigError: for a wrong interface, kind, method, reference or tolerance.
        ModesMissedError: if a count says that a mode was skipped.
        ModelError: if the basis misses a rigid motion or has columns that depend on each other.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)
        >>> family = rom.reduce_parametric(beam, parameters={"E": rom.YoungsModulus(None, 0.5, 2)},
        ...     method=rom.CraigBampton(6), interfaces={"root": "rbe2"}, certify=False)
        >>> one, two = (family.at(E=x).frequencies(1, fixed=("root",))[0] for x in (0.5, 2.0))
        >>> round(float(two / one), 6)  # frequencies go with the root of the modulus
        2.0

    Source:
        Bases at several points joined into one: Benner, Gugercin and Willcox, A survey of
        projection-based model reduction methods for parametric dynamical systems, SIAM Review
        57 (2015) 483.
    """
    check_name(name, "a body")
    between("tol", tol, 0, 1, "()")
    affine = _affine(model, checked_parameters(parameters), stress)
    middle = centre(affine.parameters)
    draft = FamilyDraft(
        model=affine.model_at(middle), method=method, interfaces=affine.kinds(interfaces),
        reference=reference, damping=damping, name=name, stress=stress, certify=certify,
        affine=affine, tol=tol, samples=[middle],
    )  # fmt: skip
    draft.ops, draft.bare = affine.at(middle), affine.bare(middle)
    family = run(stages(draft), draft)
    family.provenance["seconds to reduce"] = draft.seconds
    return family


def stages(draft: FamilyDraft) -> list[Stage]:
    """What `reduce_parametric` does: most stages are those of one body, at the centre."""
    return wanted(
        (True, connect),
        (isinstance(draft.method, Characteristic), few_functions),
        (True, join_bases),
        (True, project),
        (True, make_body),
        (draft.stress, recover),
        (True, share_out),
        (True, place_frame),
        (draft.certify, certify),
    )


def recover(draft: FamilyDraft) -> None:
    """Make stress recoverable; that of modes left out is known at one point only."""
    draft.body = replace(draft.body, stress=stress_recovery(draft.model, draft.E))


def share_out(draft: FamilyDraft) -> None:
    """Take the body apart into terms, one per region: the family."""
    provenance = draft.body.provenance
    provenance["ranges"] = written(draft.affine.parameters)
    reduction = provenance["reduction"]
    reduction["points sampled"] = draft.samples
    del reduction["frequencies of the modes kept [Hz]"]  # those of the centre, where they are known
    draft.body = BodyFamily(
        parameters=draft.affine.parameters,
        damping=draft.damping,
        provenance=provenance,
        **draft.affine.terms(draft.body, draft.E),
    )


def _affine(model: FEModel, parameters: dict[str, Parameter], stress: bool) -> AffineModel:
    if not any(isinstance(p, Thickness) for p in parameters.values()):
        return AffineModel(model, parameters)
    if stress:
        raise ParameterError(
            "stress is not recovered from bodies with a parameter of thickness.",
            hint="Reduce with stress=False.",
        )
    return StretchedModel(model, parameters)


def join_bases(draft: FamilyDraft) -> None:
    """Join the bases of the centre, the corners, and trial points whose errors are too large."""
    affine, connection = draft.affine, draft.connection
    boundary, moving = connection.boundary, affine.moving
    basis = draft.maker.basis(connection.ops, boundary, connection.labels)
    common = first_sample(connection.ops, basis, boundary, SHAPE_RATIO * np.sqrt(draft.tol))
    limit = draft.tol
    if moving:
        limit = max(limit, METHOD_ERROR_FACTOR * estimated(connection, basis))
    for ops, moved in affine.rigid_samples():
        rigid = connected(ops, moved, draft.interfaces).ops.rigid
        common = common.with_shapes(rigid, boundary)

    def visit(point: Point, *, whatever: bool) -> bool:
        nonlocal common
        here = connected(affine.at(point), affine.model_at(point), draft.interfaces)
        if not whatever and estimated(here, common.basis) <= limit:
            return False
        found = draft.maker.basis(here.ops, boundary, here.labels)
        common = common.joined(found, boundary)
        draft.samples.append(point)
        return True

    for point in corners(affine.parameters, moving):
        visit(point, whatever=True)
    draft.n_trials = TRIALS_PER_PARAMETER * len(moving)
    trials = scattered(affine.parameters, draft.n_trials)
    added = [visit(point, whatever=False) for point in trials]
    draft.basis = common.basis
    if affine.ops.first == 0:
        log.info("%d points sampled, %d of them trials; %d columns", len(draft.samples), sum(added),
                 common.basis.Psi.shape[1])  # fmt: skip
