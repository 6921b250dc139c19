"""A whole wheel as one flexible body of a mechanism, from the modes of its sector.

A mode a + i b of sector 0 with n nodal diameters moves sector j, in axes that turn along with it,
by two real shapes::

    c (a cos(n j alpha) - b sin(n j alpha)),    c (a sin(n j alpha) + b cos(n j alpha))

Integrals of the fields 1, x, a and b over one sector are computed once; those of the wheel are
their combinations, turned into the axes of the wheel and added up. The hub is at rest in all
shapes: with its rigid motion they are the Craig-Bampton basis of a wheel whose hub is rigid.

Source:
    Thomas, Dynamics of rotationally periodic structures, Int. J. Numer. Meth. Engng. 14 (1979) 81,
    for the waves; the sums of integrals over turned sectors are ours.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np
from scipy.linalg import block_diag

from rom.arguments import typed
from rom.body.flexible import FlexibleBody
from rom.body.inertia import InertiaIntegrals, fields_of, inertia_integrals
from rom.body.records import Marker, Surface
from rom.body.recovery import CENTRIFUGAL_LOADS
from rom.body.reference import rigid_marker
from rom.body.surface import one_surface
from rom.components.wheels.faces import turned
from rom.components.wheels.modes import CyclicModes, wheel_modes
from rom.components.wheels.reduced import ReducedSector
from rom.components.wheels.rotation import refuse_attachments
from rom.components.wheels.sector import Complex, CyclicSector
from rom.eigen.verbs import dofs_of
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Interface, Report
from rom.names import check_known
from rom.rows import N_COMPARED, frequency_rows, row

Turned = list[tuple[Array, Array]]  # of each sector its turn (3, 3) and shares (k, r) of fields


@typed
def wheel_body(
    sector: CyclicSector,
    model: FEModel,
    n: int,
    *,
    hub: str = "bore",
    diameters: Sequence[int] | None = None,
    name: str = "wheel",
) -> FlexibleBody:
    """The wheel of a sector as one flexible body for a mechanism; its frame sits on the rigid hub.

    Rotation about an axis x, y or z stiffens it if the sector has matrices of rotation; what other
    loads stiffen is left out.

    Args:
        sector: held at the hub alone; a reduced one is compared with the full one.
        model: the one the sector was made from.
        n: number of modes with each number of nodal diameters; most of them are two of the wheel.
        hub: interface of the model that is held, for the body a rigid one with its point on the
            axis.
        diameters: numbers of nodal diameters; all the wheel can have unless given. Motion of the
            hub meets 0 and 1 alone.
        name: of the body.

    Raises:
        ConfigError: if not just the hub is held, or the model has attachments or other points.
        InterfaceError: if the model has no such interface.
        ModelError, ModesMissedError: see `cyclic_modes`.

    Warns:
        RomWarning: if the certificate fails.
    """
    full = (sector.full if isinstance(sector, ReducedSector) else None) or sector
    text = f"the model has no interface {hub!r}; it has"
    check_known(hub, model.interfaces, text, InterfaceError)
    _refuse_others(full, model, model.interfaces[hub])
    found = wheel_modes(sector, n, diameters=diameters)
    expand = sector.expand if isinstance(sector, ReducedSector) else np.asarray
    shapes: list[Complex] = [expand(modes.shapes) for modes in found]
    F = np.hstack([part for U, modes in zip(shapes, found, strict=True)
                   for part in (U.real, U.imag)[: modes.multiplicity]])  # fmt: skip
    every = [(modes.omega, modes.diameter) for modes in found for _ in range(modes.multiplicity)]
    omega = np.concatenate([w for w, _ in every])
    order = np.argsort(omega, kind="stable")
    each = [(turned(full.axis, j * full.angle), _shares(found, j)[:, order])
            for j in range(full.n_sectors)]  # fmt: skip
    of = [f"mode {k + 1}, {d} nodal diameters" for w, d in every for k in range(w.size)]
    one = inertia_integrals(full.workers.operators(full.K, full.M), model.points - full.at, F)
    whole = _from_origin(reduce(add, (_turned(one, R, C) for R, C in each)), full.at)
    body = FlexibleBody(
        name=name,
        **fields_of(whole),
        K=np.diag(omega[order] ** 2),
        D=np.zeros((omega.size, omega.size)),
        markers={hub: _hub(model.interfaces[hub], full, omega.size)},
        omega=omega[order],
        labels=tuple(of[k] for k in order),
        reference=hub,
        K_geo=_stiffening(full, F, each, whole.S_kl),
        surface=_surface(full, model, F, each),
        provenance=model.provenance | {"reduction": {"method": f"wheel_body, {n} modes each"}},
    )
    held = {"reduced": body.frequencies(N_COMPARED, fixed=(hub,)), "full": body.omega / 2 / np.pi}
    table = {which: f[:N_COMPARED].tolist() for which, f in held.items()}
    rows = sector.certificate.rows if isinstance(sector, ReducedSector) else ()
    unit = row("mass-normalised shapes", np.abs(body.M - np.eye(omega.size)).max(), 1e-8)
    report = Report(f"certificate of {name}", (*rows, *frequency_rows(f"{hub} held", table), unit))
    report.warn_of_failures(f"the certificate of body {name!r}")
    return replace(body, certificate=report)


def _refuse_others(full: CyclicSector, model: FEModel, hub: Interface) -> None:
    """Refuse sectors of other models, on springs, or held elsewhere than at the hub."""
    refuse_attachments(model)
    if full.points is None or full.points.shape != model.points.shape:
        raise ConfigError("a wheel needs the model its sector was made from.")
    if full.sprung or not np.array_equal(np.unique(full.held), np.sort(hub.dofs)):
        text = f"the sector must be held at {hub.name!r} alone, without springs"
        raise ConfigError(f"{text}: CyclicSector.from_model(model, fixed=({hub.name!r},)).")


def _shares(found: tuple[CyclicModes, ...], j: int) -> Array:
    """(k, r) of the real and imaginary parts of all modes in the motion of sector j."""
    shares = []
    for modes in found:
        double, m, N = modes.multiplicity, modes.omega.size, modes.sector.n_sectors
        wave = np.exp(1j * modes.diameter * j * modes.sector.angle) * np.sqrt(double / N)
        turn = np.array([[wave.real, wave.imag], [-wave.imag, wave.real]])[:double, :double]
        shares.append(np.kron(turn, np.eye(m)))
    return block_diag(*shares)


def _turned(one: InertiaIntegrals, R: Array, C: Array) -> InertiaIntegrals:
    """Integrals of a sector turned by R (3, 3) about the origin, of shapes in shares C (k, r)."""
    return InertiaIntegrals(
        mass=one.mass,
        first_moment=R @ one.first_moment,
        inertia=R @ one.inertia @ R.T,
        S=R @ one.S @ C,
        Ibar_kl=np.einsum("ac,bd,cdk->abk", R, R, one.Ibar_kl) @ C,
        S_kl=np.einsum("ac,bd,cdkl,km,ln->abmn", R, R, one.S_kl, C, C, optimize=True),
    )


def _from_origin(about: InertiaIntegrals, at: Array) -> InertiaIntegrals:
    """Integrals with arms from the origin, given those with arms from a point (3,) [m]."""
    added = np.outer(at, about.first_moment + 0.5 * about.mass * at)
    second = added + added.T  # what the integral of rho x x^T has more
    return replace(
        about,
        first_moment=about.first_moment + about.mass * at,
        inertia=about.inertia + np.trace(second) * np.eye(3) - second,
        Ibar_kl=about.Ibar_kl + np.einsum("a,bk->abk", at, about.S),
    )


def _hub(face: Interface, full: CyclicSector, r: int) -> Marker:
    """The hub as a rigid interface with its point on the axis, at rest in all shapes."""
    point = full.at + full.axis * (full.axis @ (face.origin - full.at))
    return rigid_marker(face.name, point, *np.zeros((2, 3, r)))


def _stiffening(full: CyclicSector, F: Array, each: Turned, S_kl: Array) -> dict[str, Array]:
    """Geometric stiffness of rotation about an axis of the body; softening comes from inertia."""
    along = np.flatnonzero(np.abs(full.axis) > 1 - 1e-12)
    if full.centrifugal is None or not along.size:
        return {}
    A, across = F.T @ (full.centrifugal @ F), np.eye(3) - np.outer(full.axis, full.axis)
    K = sum(C.T @ A @ C for _, C in each) + np.einsum("ab,abkl->kl", across, S_kl)
    return {CENTRIFUGAL_LOADS[along[0]]: 0.5 * (K + K.T)}


def _surface(full: CyclicSector, model: FEModel, F: Array, each: Turned) -> Surface | None:
    """The surface of all sectors, without the faces on which they meet."""
    if (mesh := model.surface) is None:
        return None
    met = [np.isin(3 * mesh.nodes, face)[mesh.triangles].all(axis=1)
           for face in (full.slave, full.master)]  # fmt: skip
    kept, x = mesh.triangles[~np.any(met, axis=0)], model.points[mesh.nodes] - full.at
    shapes = F[dofs_of(mesh.nodes)].reshape(len(x), 3, -1)
    return one_surface(
        [
            Surface(full.at + x @ R.T, kept, (R @ (shapes @ C)).reshape(3 * len(x), -1))
            for R, C in each
        ]
    )
