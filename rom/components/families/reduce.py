"""The short road for parameters: one reduction for a range of them.

Bases at several points join into one, without what repeats. All keep the interface coordinates, so
that a shape of one point minus the constraint modes of the first, moved as its interfaces are,
leaves the interfaces at rest::

    Psi = [ Psi_b(p_0)  Phi(p_0)  Y ],   span Y of  Psi(p_s) - Psi_b(p_0) [Psi(p_s)]_b

The constraint modes of the first point contain the rigid motions, at every other point too. Errors
are estimated as the basis grows, and compared with full models where it was not made.
"""

import logging
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from rom.arguments import Between, typed
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.projection import elastic_part, stress_recovery
from rom.checks.certificate import (
    attach,
    basis_matrices,
    compared,
    condensed_model,
    full_support,
    reduced_shapes,
    rigid_rows,
)
from rom.checks.draft import COMPARISON_STAGE, Draft, Stage, run, wanted
from rom.components.families.affine import AffineModel, StretchedModel
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
from rom.eigen.connection import Connection
from rom.eigen.verbs import Operators, residual_errors
from rom.errors import ConfigError, ParameterError
from rom.model import Array, Basis, FEModel, Index, Report, Row
from rom.names import check_name
from rom.reduction.bases.method import Method
from rom.reduction.interfaces.characteristic import Characteristic
from rom.reduction.interfaces.connection import connect as connected
from rom.rows import N_COMPARED, frequency_rows, row
from rom.stages.bodies import connect, few_functions, make_body, place_frame, project

log = logging.getLogger("rom")
SHAPE_RATIO = 0.1  # of the square root of the tolerance: a shape dropped costs its square in energy
TRIALS_PER_PARAMETER = 2  # points at which errors are estimated while the basis grows
METHOD_ERROR_FACTOR = 2.0  # times the error at the centre, which more points do not reduce
LAST_MODE_SHARE = 0.3  # part of the last normal mode, by size, that is too little to be kept
SHAPE_RTOL = 1e-7  # of a shape's own size: remainders below are round-off
HELD_OUT = 3  # points of the certificate


@dataclass(kw_only=True)
class FamilyDraft(Draft):
    """The reduction of a family under way; its model is that at the centre of the ranges."""

    affine: AffineModel  # the model at all points
    tol: float  # error of frequencies that is accepted [1]
    samples: list[Point]  # points whose bases have joined
    n_trials: int = 0  # number of points at which errors were estimated as the basis grew


@typed
def reduce_parametric(  # noqa: PLR0913  one keyword per choice
    model: FEModel,
    *,
    parameters: dict[str, Parameter],
    method: Method | Characteristic,
    interfaces: dict[str, Any],
    reference: object = "mean-axis",
    damping: Rayleigh | ModalDamping | None = None,
    name: str = "body",
    stress: bool = False,
    tol: Annotated[float, Between(0, 1, "()")] = 1e-3,
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
    parameters = checked_parameters(parameters)
    thick = any(isinstance(p, Thickness) for p in parameters.values())
    if thick and stress:
        raise ParameterError("stress is not recovered with a parameter of thickness; leave it out.")
    affine = (StretchedModel if thick else AffineModel)(model, parameters)
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
    body, shares, stretch = draft.affine.terms(draft.body, draft.E)
    family = BodyFamily(body, draft.affine.parameters, shares, damping=draft.damping)
    draft.body = replace(family, provenance=provenance, stretch=stretch)


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
        counts = len(draft.samples), sum(added), common.basis.Psi.shape[1]
        log.info("%d points sampled, %d of them trials; %d columns", *counts)


@dataclass(frozen=True, slots=True)
class CommonBasis:
    """A basis that grows by the bases of further points."""

    ops: Operators  # operators at the first point, in interface coordinates
    basis: Basis  # interface columns first
    n_b: int  # number of interface coordinates
    weight: float  # factor of M in the inner product K + weight M [rad^2/s^2]
    small: float  # size of what is dropped, of its shape; errors of frequencies are its square

    def joined(self, other: Basis, boundary: Index) -> "CommonBasis":
        """With what is new of a basis at another point; dofs (n_b,) of the interface coordinates.

        The error that a normal mode leaves falls with the square of its frequency, and the method
        stopped at the last one: of the others the more must be kept the lower they are.
        """
        weight = np.ones(other.Psi.shape[1])
        if other.omega.size:
            falling = self.small / LAST_MODE_SHARE * (other.omega[-1] / other.omega) ** 2
            weight[-other.omega.size :] = np.minimum(falling, 1.0)
        return self.with_shapes(other.Psi * weight, boundary, max(self.small, SHAPE_RTOL), weight)

    def with_shapes(
        self, shapes: Array, boundary: Index, small: float = SHAPE_RTOL, weight: Array | float = 1.0
    ) -> "CommonBasis":
        """With what is new in shapes (n_local, k), dropped below a size of those of weight one."""
        ops, Psi = self.ops, self.basis.Psi
        inner = self._orthonormal(Psi[:, self.n_b :], 0.0)
        size = np.sqrt(np.diag(self._product(shapes, shapes))) / weight
        X = (shapes - Psi[:, : self.n_b] @ ops.rows(shapes, boundary)) / size
        for _ in range(2):
            X = X - inner @ self._product(inner, X)
        Y = self._orthonormal(X, small)
        first = Psi.shape[1] - self.n_b
        labels = tuple(f"sampled {first + k + 1}" for k in range(Y.shape[1]))
        basis = Basis(np.hstack([Psi, Y]), self.basis.omega, self.basis.labels + labels)
        return replace(self, basis=basis)

    def _product(self, X: Array, Y: Array) -> Array:
        ops = self.ops
        return ops.gram(X, ops.apply_K(Y) + self.weight * ops.apply_M(Y))

    def _orthonormal(self, X: Array, small: float) -> Array:
        """Orthonormal columns of the span of X, principal directions below a size left out."""
        if not X.shape[1]:
            return X
        G = self._product(X, X)
        scale = 1 / np.sqrt(np.diag(G)) if small == 0.0 else np.ones(X.shape[1])
        lam, U = np.linalg.eigh(scale[:, None] * (0.5 * (G + G.T)) * scale)
        kept = np.flatnonzero(lam > max(small**2, 1e-14 * lam[-1]))[::-1]
        return X @ (scale[:, None] * U[:, kept] / np.sqrt(lam[kept]))


def first_sample(ops: Operators, basis: Basis, boundary: Index, small: float) -> CommonBasis:
    """The basis of the first point, by a method that keeps interface coordinates, dofs (n_b,)."""
    n_b = boundary.size
    moved = ops.rows(basis.Psi[:, :n_b], boundary) if basis.Psi.shape[1] >= n_b > 0 else None
    if moved is None or np.abs(moved - np.eye(n_b)).max() > 1e-9:
        text = "the bases of several parameters join in interface coordinates"
        hint = "Use CraigBampton, Guyan or MomentMatching, and name an interface."
        raise ConfigError(f"{text}, which this method does not keep.", hint=hint)
    X = basis.Psi
    K, M = (np.diag(ops.gram(X, AX)) for AX in (ops.apply_K(X), ops.apply_M(X)))
    elastic = K > 1e-9 * (K / M).max() * M
    weight = float((K[elastic] / M[elastic]).min(initial=np.inf))
    return CommonBasis(ops, basis, n_b, weight if np.isfinite(weight) else 1.0, small)


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
    comparison = {}
    own = replace(basis, held=None)  # of another point
    for point in scattered(affine.parameters, HELD_OUT, 1 + draft.n_trials):
        where = ", ".join(f"{name} = {value:.4g}" for name, value in point.items())
        ops, body = affine.at(point), family.at(extrapolate=False, **point)
        here = connected(ops, affine.model_at(point), kinds)
        found: list[Row] = []
        reduction = None  # the basis of a stretched body depends on the thickness
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
        found += rigid_rows(ops, body, elastic_part(ops, draft.Psi, draft.basis.labels))
        rows += [replace(line, quantity=f"{where}: {line.quantity}") for line in found]
    report = Report(f"certificate of the family {family.body.name}", tuple(rows))
    attach(draft, report, comparison, f"family {draft.name!r}")
