"""The short road for parameters: one reduction for a range of material numbers."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from rom.attachment import added_mass, carried_displacements
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.family import BodyFamily, Share
from rom.body.inertia import InertiaIntegrals, inertia_integrals, point_integrals, weighted
from rom.body.projection import canonical_columns, elastic_part, flexible_body
from rom.certificate import (
    N_COMPARED,
    compared,
    estimates,
    frequency_rows,
    reduced_shapes,
    rigid_rows,
    row,
)
from rom.eigen import Operators
from rom.errors import ConfigError, ParameterError
from rom.model import Array, Basis, FEModel, Region, Report, Row
from rom.parameters import (
    Density,
    Parameter,
    Point,
    centre,
    checked_parameters,
    corners,
    factors,
    scattered,
    written,
)
from rom.reduction.characteristic import Characteristic
from rom.reduction.interface import Connection, connect
from rom.reduction.method import Method
from rom.reduction.samples import CommonBasis, first_sample
from rom.workflow import mesh_operators

log = logging.getLogger("rom")
SMALL = 0.1  # of the square root of the tolerance: a shape dropped costs its square in energy
TRIALS = 2  # points per parameter at which errors are estimated while the basis grows
METHOD = 2.0  # times the error of the method at the centre is no reason for another point
HELD_OUT = 3  # points of the certificate, away from those
EMPTY = 1e-12  # share of mass and stiffness below which all belongs to named regions


@dataclass(frozen=True, slots=True)
class RegionOperators:
    """The verbs that projection needs, on the matrices of one region."""

    ops: Operators
    region: Region

    @property
    def n_local(self) -> int:
        """Number of this process's rows."""
        return self.ops.n_local

    def apply_K(self, X: Array) -> Array:
        """K_i X."""
        return self.ops.product(self.region.K, X)

    def apply_M(self, X: Array) -> Array:
        """M_i X."""
        return self.ops.product(self.region.M, X)

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y summed over the ranks."""
        return self.ops.gram(X, Y)


class AffineModel:
    """A finite element model whose regions have factors of stiffness and density.

    Args:
        model: the model at factors of one.
        parameters: by name.

    Raises:
        ParameterError: if a parameter names a region that the model does not know.
    """

    def __init__(self, model: FEModel, parameters: dict[str, Parameter]):
        self.model, self.parameters = model, parameters
        self.ops = mesh_operators(model)
        self.added = added_mass(model, self.ops.first, self.ops.n_local)
        names = dict.fromkeys(p.region for p in parameters.values() if p.region is not None)
        for name in names:
            if name not in model.regions:
                raise ParameterError(
                    f"there is no region {name!r}; the model has {sorted(model.regions)}.",
                    hint="Regions are the named physical volumes of the geometry.",
                )
        self.regions = {name: model.regions[name] for name in names}

    @property
    def moving(self) -> list[str]:
        """Parameters that change shapes: not those that multiply all of K, or all of M."""
        return [
            name
            for name, p in self.parameters.items()
            if p.region is not None or (isinstance(p, Density) and self.added is not None)
        ]

    def bare(self, point: Point) -> Operators:
        """The model at some factors, without what interfaces carry."""
        k, m = factors(self.parameters, (None, *self.regions), point)
        if (k == 1).all() and (m == 1).all():
            return self.ops
        parts = self.regions.values()
        K = [(c - k[0], part.K) for c, part in zip(k[1:], parts, strict=True) if c != k[0]]
        M = [(c - m[0], part.M) for c, part in zip(m[1:], parts, strict=True) if c != m[0]]
        return self.ops.varied((k[0], K), (m[0], M))

    def at(self, point: Point) -> Operators:
        """The model at some factors with all it carries."""
        ops = self.bare(point)
        return ops if self.added is None else ops.plus_mass(self.added)

    def shares(self, E: Array, stress: Array | None) -> Iterator[Share]:
        """The terms in the coordinates of the shapes.

        Args:
            E: (n_local, r) shapes.
            stress: (6 p, r) stress on the surface at factors of one [Pa], or None.
        """
        ops = self.ops
        first, K = ops.first // 3, _symmetric(ops.gram(E, ops.apply_K(E)))
        points = self.model.points[first : first + ops.n_local // 3]
        rest = inertia_integrals(ops, points, E)
        mass, stiffness = rest.mass, np.trace(K)
        for name, region in self.regions.items():
            part: Any = RegionOperators(ops, region)
            integrals = inertia_integrals(part, points, E)
            share = Share(
                name,
                integrals,
                _symmetric(part.gram(E, part.apply_K(E))),
                None if stress is None else _stress(region.stresses, self.model, E),
            )
            yield share
            rest, K = weighted(np.array([1, -1]), [rest, integrals]), K - share.K
            stress = None if stress is None else stress - share.stress
        if rest.mass > EMPTY * mass or np.trace(K) > EMPTY * stiffness:
            yield Share(None, rest, K, stress)
        if self.model.attachments:
            yield Share(None, self._carried(E), np.zeros_like(K), None, fixed=True)

    def _carried(self, E: Array) -> InertiaIntegrals:
        parts = []
        for attachment in self.model.attachments:
            points, masses, N = carried_displacements(attachment, self.model)
            dofs = self.model.interfaces[attachment.interface].dofs
            parts.append(point_integrals(points, masses, N @ self.ops.rows(E, dofs)))
        return weighted(np.ones(len(parts)), parts)


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
    """Flexible bodies for a range of moduli and densities, from one reduction.

    Bases at the centre and the corners of the ranges join into one; where the estimated error of a
    frequency exceeds the tolerance at a point between, the basis of that point joins too.

    Args:
        model: the full model, free-free, at factors of one.
        parameters: {name: `YoungsModulus` or `Density`}.
        method: how to reduce at one point; one that keeps interface coordinates, for example
            ``CraigBampton(n_modes=20)``.
        interfaces: {name: kind}, see `rom.reduce`.
        reference: how the floating frame follows the bodies, see `FlexibleBody.with_reference`.
        damping: structural damping, made anew at every point.
        name: name of the bodies.
        stress: make the stress on the outer surface recoverable.
        tol: relative error of the first frequencies that is accepted; where the method alone has
            nearly as much at the centre, more points are no cure.
        certify: compare with full models at points that were not sampled.

    Returns:
        BodyFamily; ``family.at(name=factor)`` is a `FlexibleBody`.

    Raises:
        ParameterError: for a wrong parameter or an unknown region.
        InterfaceError, ConfigError: for a wrong interface, kind, method, reference or tolerance.
        ModesMissedError: if the inertia count says that a mode was skipped.
    """
    clock = perf_counter()
    if isinstance(tol, bool) or not 0 < tol < 1:
        raise ConfigError(f"tol = {tol!r} is not a relative error between 0 and 1.")
    affine = AffineModel(model, checked_parameters(parameters))
    middle = centre(affine.parameters)
    connection = connect(affine.at(middle), model, interfaces)
    described = repr(method)
    if isinstance(method, Characteristic):
        interfaces = method.kinds(connection, interfaces)
        method = method.method
        connection = connect(affine.at(middle), model, interfaces)
    common, samples = _common_basis(affine, connection, method, interfaces, tol)
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
        model, bare, Psi, elastic, ties=connection.ties, name=name, stress=stress,
        provenance=provenance,
    )  # fmt: skip
    E = canonical_columns(bare, Psi @ elastic.V, model)
    shares = tuple(affine.shares(E, None if body.stress is None else body.stress.operator))
    family = BodyFamily(body, affine.parameters, shares, damping=damping, provenance=provenance)
    family = family.with_reference(reference)
    provenance["seconds to reduce"] = round(perf_counter() - clock, 3)
    if not certify:
        return family
    certificate, comparison = _certified(affine, family, connection, common.basis, interfaces, tol)
    return replace(
        family, certificate=certificate, provenance=provenance | {"comparison": comparison}
    )


def _common_basis(
    affine: AffineModel,
    connection: Connection,
    method: Method,
    interfaces: dict[str, Any],
    tol: float,
) -> tuple[CommonBasis, list[Point]]:
    """The bases of the centre, of the corners, and of trial points whose errors are too large."""
    boundary = connection.boundary
    basis = method.basis(connection.ops, boundary, connection.labels)
    common = first_sample(connection.ops, basis, boundary, SMALL * np.sqrt(tol))
    samples, moving = [centre(affine.parameters)], affine.moving
    limit = max(tol, METHOD * _estimated(connection, basis)) if moving else tol

    def visit(point: Point, *, whatever: bool) -> bool:
        nonlocal common
        here = connect(affine.at(point), affine.model, interfaces)
        if not whatever and _estimated(here, common.basis) <= limit:
            return False
        found = method.basis(here.ops, boundary, here.labels)
        common = common.joined(found, boundary)
        samples.append(point)
        return True

    for point in corners(affine.parameters, moving):
        visit(point, whatever=True)
    trials = scattered(affine.parameters, TRIALS * len(moving))
    added = [visit(point, whatever=False) for point in trials]
    if affine.ops.first == 0:
        log.info("%d points sampled, %d of them trials; %d columns", len(samples), sum(added),
                 common.basis.Psi.shape[1])  # fmt: skip
    return common, samples


def _supports(connection: Connection) -> list[tuple[str, ...]]:
    return [(), *((name,) for name in connection.parts)]


def _estimated(connection: Connection, basis: Basis) -> float:
    """The largest estimated error of the first frequencies, free and on each interface."""
    ops, worst = connection.ops, 0.0
    inner = ops.hold(connection.boundary)
    for fixed in _supports(connection):
        n_rigid = 0 if fixed else 6
        held = sum(connection.parts[name].size for name in fixed)
        n = min(N_COMPARED, basis.Psi.shape[1] - held - n_rigid)
        if n > 0:
            shapes = reduced_shapes(connection, basis, fixed, n + n_rigid)[:, n_rigid:]
            worst = max(worst, float(estimates(ops, inner, shapes).max()))
    return worst


def _certified(
    affine: AffineModel,
    family: BodyFamily,
    connection: Connection,
    basis: Basis,
    interfaces: dict[str, Any],
    tol: float,
) -> tuple[Report, dict[str, Any]]:
    """Bodies of a family against full models, at points that were not sampled."""
    rows: list[Row] = []
    comparison: dict[str, Any] = {}
    first = 1 + TRIALS * len(affine.moving)
    Psi = connection.ops.expand(basis.Psi)
    for point in scattered(affine.parameters, HELD_OUT, first):
        where = ", ".join(f"{name} = {value:.4g}" for name, value in point.items())
        ops, body = affine.at(point), family.at(extrapolate=False, **point)
        here = connect(ops, affine.model, interfaces)
        inner = here.ops.hold(here.boundary)
        found: list[Row] = []
        for fixed in _supports(here):
            table = compared(here, ops, body, (basis, inner), fixed)
            if not table["reduced"]:
                continue
            support = " + ".join(fixed) + " held" if fixed else "free"
            comparison[f"{where}: {support}"] = table
            if table["full"]:
                found += frequency_rows(support, table, tol)
            else:
                said = f"{support}: estimated error of {len(table['reduced'])} frequencies"
                found.append(row(said, max(table["estimated"]), tol))
        found += rigid_rows(ops, body, elastic_part(ops, Psi))
        rows += [replace(line, quantity=f"{where}: {line.quantity}") for line in found]
    return Report(f"certificate of the family {family.body.name}", tuple(rows)), comparison


def _stress(stresses: Any, model: FEModel, E: Array) -> Array:
    nodes = model.surface.nodes
    found: Array = stresses.at_nodes(E, nodes).reshape(6 * nodes.size, -1)
    return found


def _symmetric(A: Array) -> Array:
    return 0.5 * (A + A.T)
