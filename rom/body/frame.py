"""The same deformations seen from another floating frame."""

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from rom.body.nonlinear.quartic import Quartic
from rom.body.records import Body
from rom.body.recovery import StressRecovery
from rom.body.reference import MEAN_AXES, moved_frame, reference_motion, rigid_marker
from rom.body.stiffening import SecondOrder, moved_stiffening, recombined_stiffening
from rom.eigen.verbs import Operators, own_points, rigid_motions
from rom.errors import ConfigError, ModelError
from rom.model import OWN_FRAME, Array, FEModel, Interface

STILL_RTOL = 1e-9  # momentum of a shape, of the largest that its mass lets it have


def on_mean_axes(body: Body) -> Body:
    """The same elastic coordinates on mean axes, see `FlexibleBody.on_mean_axes`."""
    rests = _moves_around_rest(body) if body.K_geo else body.reference in MEAN_AXES
    if rests or body.quartic is not None:
        return body
    if OWN_FRAME in body.markers:
        raise ConfigError(f"body {body.name!r}: an interface {OWN_FRAME!r} needs another name.")
    own = rigid_marker(OWN_FRAME, np.zeros(3), *np.zeros((2, 3, body.n_modes)))
    framed = replace(body, markers=body.markers | {OWN_FRAME: own})
    return moved_to(framed, "mean-axis")


def _moves_around_rest(body: Body) -> bool:
    """Whether neither shapes nor second order have momentum or moment of momentum."""
    psi, size = SecondOrder.of(body), body.size
    limit = STILL_RTOL * np.sqrt(np.diag(body.M).max(initial=0.0) * body.mass)
    turning = [(X - X.swapaxes(0, 1)) / size for X in (body.Ibar_kl, psi.Ibar)]
    largest = max(np.abs(x).max(initial=0.0) for x in (body.S, psi.S, *turning))
    return bool(body.n_modes > 0 and largest <= limit)


def seen_from(body: Body, reference: object) -> Body:
    """The body in another frame, see `FlexibleBody.with_reference`."""
    return on_normal_modes(moved_to(body, reference))[0]


def at_large_deflection(
    body: Body, reference: object, E: Array, model: FEModel, ops: Operators
) -> tuple[Body, Array]:
    """The body in another frame with its energy at finite strain, and its shapes E there."""
    X, (found, V) = reference_motion(body, reference), on_normal_modes(moved_to(body, reference))
    shapes = (E - rigid_motions(own_points(ops, model.points)) @ X) @ V
    energy = Quartic.from_gram(model.stresses.large_strain().gram(shapes), found.n_modes)
    markers = {
        name: replace(marker, covariance=_covariance(ops, model.interfaces[name], shapes))
        for name, marker in found.markers.items()
    }
    return replace(found, markers=markers, quartic=replace(energy, K=found.K)), shapes


def _covariance(ops: Operators, interface: Interface, E: Array) -> Array:
    """(3, 3, 1 + r) that of an interface under shapes E (n_local, r), see `Marker.covariance`."""
    area = np.asarray(interface.surface_mass.sum(axis=0)).ravel()
    X = interface.points - area @ interface.points / area.sum()
    weights = interface.surface_mass @ X
    moved = np.concatenate([X[..., None], ops.rows(E, interface.dofs).reshape(len(X), 3, -1)], 2)
    return np.einsum("nak,nb->abk", moved, weights) / float((X * weights).sum())


def moved_to(body: Body, reference: object) -> Body:
    """The body in another frame, with the elastic coordinates it has."""
    if body.quartic is not None:
        text = f"body {body.name!r} of large deflection is seen from {body.reference!r} for good"
        raise ModelError(f"{text}; give rom.reduce the other reference.")
    X = reference_motion(body, reference)
    moved = moved_frame(body, X)
    stress = body.stress.moved(X) if isinstance(body.stress, StressRecovery) else None
    stiffening = moved_stiffening(body, moved, X, reference)
    return replace(moved, K_geo=stiffening, stress=stress, reference=reference_label(reference))


def reference_label(reference: object) -> str:
    """How a reference condition is written in labels and files."""
    if isinstance(reference, tuple | list):
        return ("pins " if len(reference) == 2 else "3-2-1 ") + " ".join(reference)
    return "mean-axis" if reference == "free" else str(reference)


def on_normal_modes(body: Body) -> tuple[Body, Array]:
    """The body with its normal modes as elastic coordinates, q = V q_new, and V (r, r)."""
    smallest = np.linalg.eigvalsh(body.M).min(initial=np.inf)
    if smallest <= 0:
        text = f"the elastic mass matrix has the eigenvalue {smallest:.3g}, of a rigid motion"
        raise ModelError(f"{text}; choose a reference condition that stops all six.")
    lam, V = eigh(body.K, body.M)
    omega = np.sqrt(np.maximum(lam, 0.0))
    V = V * np.sign(V[np.argmax(np.abs(V), axis=0), np.arange(V.shape[1])])
    labels = mode_labels(omega.size, body.reference)
    return replace(recombined(body, V), K=np.diag(omega**2), omega=omega, labels=labels), V


def mode_labels(r: int, reference: str) -> tuple[str, ...]:
    """What r normal modes are called, seen from the frame of a reference condition."""
    return tuple(f"mode {k + 1}, {reference} frame" for k in range(r))


def recombined(body: Body, V: Array) -> Body:
    """The body in other elastic coordinates, q = V q_new with V (r, m), and its old labels."""
    markers = {
        name: replace(
            m,
            translation=m.translation @ V,
            rotation=m.rotation @ V,
            hold=np.hstack([m.hold[:, :6], m.hold[:, 6:] @ V]),
        )
        for name, m in body.markers.items()
    }
    surface = body.surface
    if surface is not None:
        surface = replace(surface, shape=surface.shape @ V)
    stress = body.stress.recombined(V) if isinstance(body.stress, StressRecovery) else None
    S_kl = np.einsum("abkl,km,ln->abmn", body.S_kl, V, V, optimize=True)
    K, D = (V.T @ A @ V for A in (body.K, body.D))
    return replace(
        body,
        S=body.S @ V,
        Ibar_kl=body.Ibar_kl @ V,
        S_kl=0.5 * (S_kl + S_kl.transpose(1, 0, 3, 2)),
        K=0.5 * (K + K.T),
        D=0.5 * (D + D.T),
        K_geo=recombined_stiffening(body.K_geo, V),
        markers=markers,
        surface=surface,
        stress=stress,
    )
