"""The short road for parameters: one reduction for a range of them."""

import logging
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from rom.arguments import between, typed
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.projection import canonical_columns, elastic_part, flexible_body
from rom.components.families.affine import AffineModel
from rom.components.families.common_basis import CommonBasis, first_sample
from rom.components.families.evidence import certified, estimated
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
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.records import Connection

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
    clock = perf_counter()
    between("tol", tol, 0, 1, "()")
    affine = _affine(model, checked_parameters(parameters), stress)
    middle = centre(affine.parameters)
    there, kinds = affine.model_at(middle), affine.kinds(interfaces)
    connection = connect(affine.at(middle), there, kinds)
    described = repr(method)
    if isinstance(method, Characteristic):
        interfaces = kinds = method.kinds(connection, interfaces)
        method = method.method
        connection = connect(affine.at(middle), there, kinds)
    common, samples = _common_basis(affine, connection, method, kinds, tol)
    Psi = connection.ops.expand(common.basis.Psi)
    elastic, bare = elastic_part(affine.at(middle), Psi), affine.bare(middle)
    provenance = model.provenance | {
        "reduction": {
            "method": described,
            "full dofs": affine.ops.n,
            "columns": list(common.basis.labels),
            "static shapes": True,
            "points sampled": samples,
        },
        "ranges": written(affine.parameters),
    }
    body = flexible_body(
        there, bare, Psi, elastic, ties=connection.ties, name=name, provenance=provenance,
        stress=(lambda _: None) if stress else None,
    )  # fmt: skip
    E = canonical_columns(bare, Psi @ elastic.V, there)
    family = BodyFamily(
        parameters=affine.parameters,
        damping=damping,
        provenance=provenance,
        **affine.terms(body, E),
    )
    family = family.with_reference(reference)
    provenance["seconds to reduce"] = round(perf_counter() - clock, 3)
    if not certify:
        return family
    certificate, comparison = certified(
        affine, family, connection, common.basis, interfaces, tol,
        first=1 + TRIALS_PER_PARAMETER * len(affine.moving),
    )  # fmt: skip
    certificate.warn_of_failures(f"the certificate of family {name!r}")
    return replace(
        family, certificate=certificate, provenance=provenance | {"comparison": comparison}
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


def _common_basis(
    affine: AffineModel,
    connection: Connection,
    method: Method,
    kinds: dict[str, Any],
    tol: float,
) -> tuple[CommonBasis, list[Point]]:
    """The bases of the centre, of the corners, and of trial points whose errors are too large."""
    boundary = connection.boundary
    basis = method.basis(connection.ops, boundary, connection.labels)
    common = first_sample(connection.ops, basis, boundary, SHAPE_RATIO * np.sqrt(tol))
    samples, moving = [centre(affine.parameters)], affine.moving
    limit = max(tol, METHOD_ERROR_FACTOR * estimated(connection, basis)) if moving else tol
    for ops, moved in affine.rigid_samples():
        common = common.with_shapes(connect(ops, moved, kinds).ops.rigid, boundary)

    def visit(point: Point, *, whatever: bool) -> bool:
        nonlocal common
        here = connect(affine.at(point), affine.model_at(point), kinds)
        if not whatever and estimated(here, common.basis) <= limit:
            return False
        found = method.basis(here.ops, boundary, here.labels)
        common = common.joined(found, boundary)
        samples.append(point)
        return True

    for point in corners(affine.parameters, moving):
        visit(point, whatever=True)
    trials = scattered(affine.parameters, TRIALS_PER_PARAMETER * len(moving))
    added = [visit(point, whatever=False) for point in trials]
    if affine.ops.first == 0:
        log.info("%d points sampled, %d of them trials; %d columns", len(samples), sum(added),
                 common.basis.Psi.shape[1])  # fmt: skip
    return common, samples
