"""The short road: from a finite element model to a certified flexible body."""

import logging
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Literal, overload

import numpy as np

from rom.arguments import AnySector, typed
from rom.assembly.dual import FreeSubstructure, free_substructure, with_certificate
from rom.assembly.pieces import Pieces, Tree, together
from rom.body.correction import residual_motion
from rom.body.damping import ModalDamping, Rayleigh, damped
from rom.body.flexible import FlexibleBody
from rom.body.frame import at_large_deflection
from rom.body.nonlinear.cauchy import refuse_many
from rom.body.nonlinear.geometric import enriched
from rom.body.nonlinear.ranges import Geometric
from rom.body.nonlinear.sampled import sampled_energy
from rom.body.prestress import UnitLoads
from rom.body.projection import (
    canonical_columns,
    cauchy_recovery,
    elastic_part,
    flexible_body,
    stressed_nodes,
)
from rom.body.records import Marker
from rom.checks.certificate import certify_body
from rom.checks.deflection import deflection_rows
from rom.eigen.verbs import Operators
from rom.errors import ConfigError, InterfaceError
from rom.fields import taker
from rom.model import Array, Basis, FEModel, Index
from rom.names import check_name
from rom.process.progress import MANY_DOFS, stages
from rom.process.stopwatch import Stopwatch, stopwatch
from rom.reduction.bases.assumed import AssumedModes, obeying
from rom.reduction.bases.method import CraigBampton, Method
from rom.reduction.full_model import mesh_operators, operators
from rom.reduction.interfaces.characteristic import Characteristic
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.kinds import by_name
from rom.reduction.interfaces.order import with_orders
from rom.reduction.interfaces.records import Connection

log = logging.getLogger("rom")
ENOUGH_MODES = CraigBampton()  # as many as the certificate needs


@overload
def reduce(
    model: FEModel,
    *,
    method: Method | Characteristic = ...,
    interfaces: dict[str, Any] | None = None,
    reference: Any = "mean-axis",
    damping: Rayleigh | ModalDamping | None = None,
    name: str = "body",
    stress: bool = False,
    stiffening: bool = False,
    nonlinear: Geometric | None = None,
    certify: bool | Literal["full"] = True,
) -> FlexibleBody: ...


@overload
def reduce(
    model: AnySector, *, method: CraigBampton, interfaces: dict[str, Any] | None = None
) -> Any: ...


@typed
def reduce(  # noqa: PLR0913  one keyword per choice
    model: FEModel | AnySector,
    *,
    method: Method | Characteristic = ENOUGH_MODES,
    interfaces: dict[str, Any] | None = None,
    reference: Any = "mean-axis",
    damping: Rayleigh | ModalDamping | None = None,
    name: str = "body",
    stress: bool = False,
    stiffening: bool = False,
    nonlinear: Geometric | None = None,
    certify: bool | Literal["full"] = True,
) -> Any:
    """A flexible body that stands for the full model, with the evidence for it.

    Args:
        model: the full model, free-free; or one sector of a wheel, which gives a reduced sector
            with ``interfaces={"cyclic": Polynomial(4)}`` on its cyclic faces, see `reduce_sector`.
        method: how to reduce, for example ``CraigBampton(n_modes=20)``; also `Guyan`, `Rubin`,
            `Herting`, `EnhancedCraigBampton`, `Characteristic`, `FreeFree`, `AssumedModes`. If
            missing, ``CraigBampton()``, which keeps as many modes as the certificate needs.
        interfaces: {name: kind} with the kinds "full", "rbe2", "rbe3", `Polynomial`,
            `FourierLegendre` or `Snapshots`; ``Polynomial()`` has its order chosen from the band
            and the tolerance of the method.
        reference: how the floating frame follows the body, see `FlexibleBody.with_reference`.
        damping: structural damping; none if not given.
        name: name of the body.
        stress: make the stress on the outer surface recoverable, ``body.stress``; with nonlinear
            that of finite strain, in the deformed body.
        stiffening: give the body the geometric stiffness of centrifugal force and of loads on its
            interfaces, ``body.K_geo``: fast rotation and tension then stiffen it.
        nonlinear: the loads under which the body is to deflect far, see `Geometric`: shapes are
            added for them, and ``body.quartic`` is its energy at finite strain. The reference is
            then an interface.
        certify: compare with the full model; costs a search for its modes in each support, with
            the factor of the reduction where interfaces were held for that. Where these take more
            than a minute and more than the reduction, full modes are those of the free body alone,
            and errors are estimated in the other supports; "full" has them everywhere.

    On a terminal a line says how far the reduction of a large model is; not under ``-q``, and not
    where the logger "rom" is set to errors.

    Returns:
        FlexibleBody, or ReducedSector; its ``certificate`` tells how far to trust it, and
        ``provenance["stages"]`` where the time has gone: per stage its seconds, those of
        factorisations, solutions and searches for modes in it and how many they were, and the
        largest memory of the process so far [MB].

    Raises:
        InterfaceError, ConfigError: for a wrong interface, kind, method or reference.
        ModesMissedError: if a count says that a mode was skipped.
        ModelError: if the basis misses a rigid motion or has columns that depend on each other.
        SolverError: if no order of ``Polynomial()`` is accurate enough.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)
        >>> kinds = {"root": "rbe2", "tip": "rbe2"}
        >>> body = rom.reduce(beam, method=rom.CraigBampton(40), interfaces=kinds)
        >>> body.n_modes, body.certificate.ok  # 2 x 6 + 40 coordinates less 6 rigid motions
        (46, True)
    """
    if not isinstance(model, FEModel):
        of_bodies = (reference != "mean-axis", damping, stress, stiffening, nonlinear)
        return taker("reduce", model)(model, method, interfaces or {}, of_bodies=any(of_bodies))
    check_name(name, "a body")
    if nonlinear is not None and stiffening:
        raise ConfigError(
            "stiffening is that of small deflection; nonlinear has the stiffening of loads in its "
            "energy.",
            hint="Leave stiffening out.",
        )
    if nonlinear is not None and nonlinear.sampling is not None and stress:
        raise ConfigError(
            "stress and sampling do not go together: most elements are left out.",
            hint="Leave stress out, or sampling for St. Venant-Kirchhoff material.",
        )
    with stopwatch() as watch:
        body = _reduced_body(
            watch, model, method, interfaces or {}, name=name, reference=reference,
            damping=damping, further=(stress, stiffening, nonlinear), certify=certify,
        )  # fmt: skip
    body.provenance["stages"] = watch.table()
    return body


@typed
def reduce_pieces(
    models: Mapping[str, FEModel],
    *,
    reference: str,
    method: Method = ENOUGH_MODES,
    interfaces: dict[str, Any] | None = None,
    nonlinear: Geometric | None = None,
    damping: Rayleigh | ModalDamping | None = None,
    certify: bool = True,
) -> Pieces:
    """Reduced bodies of the pieces of one solid, for rotations beyond what one frame carries.

    Args:
        models: {name: piece} of `rom.fe.pieces`, or any others that have an interface of one name
            where they meet.
        reference: interface at which the whole is held, or that turns least; each piece is seen
            from its section towards it.
        method: how to reduce each of them.
        interfaces: {name: kind}; "rbe3" for all that are not named.
        nonlinear: the loads of the whole under which it is to deflect far; each piece is made for
            those that reach its sections. Pieces that repeat each other are reduced once, for the
            largest loads of any of them.
        damping: structural damping of each.
        certify: compare each piece with its full model.

    Raises:
        RomError: for pieces that do not hang together, or form a ring; see `reduce`.

    Example:
        >>> beam = {"n": 2, "axis": (1, 0, 0), "material": rom.Material(E=2e11, nu=0, rho=7850.0)}
        >>> beam["parameters"] = {"hex": 1, "nx": 8, "ny": 1, "nz": 1}
        >>> models = rom.fe.pieces("meshes/beam.geo", **beam)
        >>> rom.reduce_pieces(models, reference="root", method=rom.CraigBampton(n_modes=2))
        Pieces(2 bodies with 16 coordinates, 1 welds)
    """
    tree = Tree.of(models, reference)
    ranges = dict.fromkeys(models) if nonlinear is None else tree.ranges(nonlinear, models)
    kinds, bodies = interfaces or {}, dict[str, FlexibleBody]()
    tree.refuse_unknown(kinds, models)
    repeated = tree.repeated(models, kinds)
    for name, seen_from in tree.reference.items():
        if name in repeated:
            continue
        copies = [(ranges[key], one) for key, one in repeated.items() if one.of == name]
        bodies[name] = reduce(
            models[name], method=method, reference=seen_from,
            nonlinear=together(ranges[name], copies),
            interfaces={key: kinds.get(key, "rbe3") for key in models[name].interfaces},
            damping=damping, name=name, certify=certify,
        )  # fmt: skip
    bodies |= {key: one.named_as(bodies[one.of], key) for key, one in repeated.items()}
    places = {key: one.shift for key, one in repeated.items()}
    return Pieces({name: bodies[name] for name in models}, tree.joints, places)


def _with_sampling_or_stress(
    body: FlexibleBody, model: FEModel, E: Array, nonlinear: Geometric, *, stress: bool
) -> FlexibleBody:
    """A body of large deflection, its energy by a few elements, or with its stress if wanted."""
    if nonlinear.sampling is None:
        return replace(body, stress=cauchy_recovery(model, E)) if stress else body
    energy, training = sampled_energy(body, nonlinear, model.stresses.large_strain(), E)
    body.provenance["sampling"] = training
    return replace(body, quartic=energy)


def _reduced_body(  # noqa: PLR0913  those of `reduce`
    watch: Stopwatch,
    model: FEModel,
    method: Method | Characteristic,
    interfaces: dict[str, Any],
    *,
    name: str,
    reference: Any,
    damping: Rayleigh | ModalDamping | None,
    further: tuple[bool, bool, Geometric | None],
    certify: bool | Literal["full"],
) -> FlexibleBody:
    """The body of `reduce`, timed; `further` are stress, stiffening and large deflection."""
    stress, stiffening, nonlinear = further
    watch.begin("interfaces")
    bare, ops = mesh_operators(model), operators(model)
    interfaces, method = with_orders(ops, model, by_name(interfaces), method)
    connection, chosen = _connected(ops, model, interfaces, method, reference)
    with _on_interfaces(interfaces), stages(2, long=ops.n > MANY_DOFS) as begin:
        watch.begin("shapes")
        begin(f"shapes of {ops.n} dofs")
        basis = chosen.basis(connection.ops, connection.boundary, connection.labels)
        if nonlinear is not None:
            watch.begin("derivatives of shapes")
            basis = enriched(nonlinear, model, ops, connection, basis, reference)
            if stress:
                refuse_many(stressed_nodes(model).size, basis.Psi.shape[1] - 6)
        watch.begin("energies")
        begin(f"energies of {basis.Psi.shape[1]} shapes")
        Psi = connection.ops.expand(basis.Psi)
        elastic = elastic_part(ops, Psi)

    watch.begin("body")
    body = flexible_body(
        model,
        bare,
        Psi,
        elastic,
        ties=connection.ties,
        name=name,
        stress=_left_out(model, ops, connection, basis) if stress and not nonlinear else None,
        stiffening=UnitLoads(model, bare, ops, connection) if stiffening else None,
        pressing=None
        if stiffening or nonlinear or model.stresses is None
        else UnitLoads(model, bare, ops, connection),
        provenance=model.provenance | {"reduction": _described(method, basis, ops.n)},
    )
    if nonlinear is None:
        body, E = body.with_reference(reference), None
    else:
        E = canonical_columns(bare, Psi @ elastic.V, model)
        body, E = at_large_deflection(body, reference, E, model, bare)
        body = _with_sampling_or_stress(body, model, E, nonlinear, stress=stress)
    if damping is not None:
        body = damped(body, damping)
    watch.end()
    body.provenance["seconds to reduce"] = round(watch.seconds, 3)
    if not certify:
        return body
    watch.begin("comparison")
    _say(ops, "compare the reduced body with the full model")
    certificate, comparison = certify_body(
        connection, ops, body, basis, elastic, everywhere=certify == "full"
    )
    if nonlinear is not None and E is not None:
        rows, deflections = deflection_rows(nonlinear, model, ops, connection, body, E)
        certificate = replace(certificate, rows=(*certificate.rows, *rows))
        body.provenance["large deflection"] = deflections
    certificate.warn_of_failures(f"the certificate of body {name!r}")
    return replace(
        body, certificate=certificate, provenance=body.provenance | {"comparison": comparison}
    )


def _connected(
    ops: Operators, model: FEModel, interfaces: dict[str, Any], method: Any, reference: Any
) -> tuple[Connection, Any]:
    """The model in interface coordinates, and the method that finds its shapes there."""
    connection = connect(ops, model, interfaces)
    _say(ops, "reduce %d dofs to %d interface coordinates", ops.n, connection.boundary.size)
    if isinstance(method, Characteristic):
        connection = connect(ops, model, method.kinds(connection, interfaces))
        method = method.method
        _say(ops, "full interfaces follow %d coordinates", connection.boundary.size)
    return connection, _chosen(method, model, connection, reference)


def _say(ops: Operators, message: str, *numbers: int) -> None:
    """Progress, aloud on one process only."""
    log.log(logging.INFO if ops.first == 0 else logging.DEBUG, message, *numbers)


def _left_out(
    model: FEModel, ops: Operators, connection: Connection, basis: Basis
) -> Callable[[dict[str, Marker]], Array | None]:
    """The function of the markers that gives the motion which the basis leaves out."""

    def motion(markers: dict[str, Marker]) -> Array | None:
        holds = {name: marker.hold for name, marker in markers.items()}
        own = slice(ops.first // 3, (ops.first + ops.n_local) // 3)
        return residual_motion(ops, connection, basis, holds, model.points[own])

    return motion


def _chosen(method: Any, model: FEModel, connection: Connection, reference: Any) -> Any:
    """The method, with what it has to know of the supports or of the frame."""
    chosen = judged_in(method, tuple(connection.parts.values()))
    if isinstance(chosen, AssumedModes):
        origins = {name: model.interfaces[name].origin for name in connection.parts}
        chosen = obeying(chosen, connection, origins, reference)
    return chosen


def judged_in(method: Any, supports: tuple[Index, ...]) -> Any:
    """The method; if it chooses the number of its modes, so that they serve all supports."""
    inner = getattr(method, "method", None)
    if inner is not None:
        return replace(method, method=judged_in(inner, supports))
    chooses = isinstance(method, CraigBampton) and method.chooses
    return replace(method, supports=supports) if chooses else method


@contextmanager
def _on_interfaces(names: Iterable[str]) -> Iterator[None]:
    """Say which interfaces an error of the reduction is about, which knows of dofs alone."""
    try:
        yield
    except InterfaceError as error:
        error.where = error.where or f"interfaces {', '.join(names)}"
        raise


@typed
def substructure(
    model: FEModel, *, n_modes: int, interfaces: dict[str, Any], certify: bool = True
) -> FreeSubstructure:
    """A free body for coupling by interface forces: MacNeal, Rubin, dual Craig-Bampton.

    Args:
        model: the full model, free-free.
        n_modes: number of elastic free-free modes.
        interfaces: {name: kind} as for `reduce`.
        certify: compare with the full model; costs one more factorisation per interface.

    Raises:
        InterfaceError, ConfigError: for a wrong interface, kind or number of modes.

    Source:
        Rixen, A dual Craig-Bampton method for dynamic substructuring, J. Comput. Appl. Math.
        168 (2004) 383; see docs/theory/other_bases.md.
    """
    connection = connect(operators(model), model, by_name(interfaces))
    origins = {name: model.interfaces[name].origin for name in connection.parts}
    body = free_substructure(connection, origins, n_modes)
    return with_certificate(body, connection) if certify else body


def _described(method: Any, basis: Any, n: int) -> dict[str, Any]:
    alone = all(re.fullmatch(r"(rigid|free) \d+", label) for label in basis.labels)
    return {
        "method": repr(method),
        "full dofs": n,
        "columns": list(basis.labels),
        "static shapes": not alone,
        "frequencies of the modes kept [Hz]": (basis.omega / (2 * np.pi)).tolist(),
    }
