"""The short road: from a finite element model to a certified flexible body."""

from typing import Any, Literal, overload

from rom.arguments import AnySector, typed
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.flexible import FlexibleBody
from rom.body.nonlinear.ranges import Geometric
from rom.checks.certificate import certify
from rom.checks.draft import Draft, Stage, run, wanted
from rom.fields import taker
from rom.model import FEModel
from rom.names import check_name
from rom.reduction.bases.assumed import AssumedModes
from rom.reduction.bases.method import CraigBampton, Method
from rom.reduction.interfaces.characteristic import Characteristic
from rom.stages import bodies

ENOUGH_MODES = CraigBampton()  # as many as the certificate needs


def stages(draft: Draft) -> list[Stage]:
    """What `rom.reduce` does with a draft, in its order: method and options add stages."""
    if draft.nonlinear is not None:
        from rom.stages import deflection

        return deflection.stages(draft)
    return wanted(
        (draft.open_orders, bodies.choose_orders),
        (True, bodies.connect),
        (isinstance(draft.method, Characteristic), bodies.few_functions),
        (isinstance(draft.method, AssumedModes), bodies.obey_reference),
        (True, bodies.basis),
        (True, bodies.project),
        (True, bodies.make_body),
        (draft.stress, bodies.recover),
        (draft.stiffening, bodies.stiffen),
        (draft.model.stresses and not (draft.stiffening or draft.model.springs), bodies.press),
        (True, bodies.place_frame),
        (draft.damping is not None, bodies.damp),
        (draft.certify, certify),
    )


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

    By stages, which `rom.workflow.stages` lists.

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
    draft = Draft(model=model, method=method, interfaces=interfaces or {}, reference=reference)
    draft.damping, draft.nonlinear, draft.certify = damping, nonlinear, certify
    draft.name, draft.stress, draft.stiffening = name, stress, stiffening
    body = run(stages(draft), draft)
    body.provenance.update({"seconds to reduce": draft.seconds, "stages": draft.watch.table()})
    return body
