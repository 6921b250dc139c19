"""Reference conditions: how the floating frame follows a deforming body.

A condition C u = 0 (six rows) ties the frame to the body. On shapes Psi it acts as the projector
Psi' = Psi - R X, X = (C R)^-1 C Psi, with R the rigid motions: stiffness is untouched,
span{R, Psi} stays the same, and only the inertia coupling of frame and shapes changes. Small
motions are identical whatever the frame; large ones differ at second order in the deformation.

Source:
    O'Shea, Jayakumar, Mechergui, Shabana, Wang, Reference conditions and substructuring techniques
    in flexible multibody system dynamics, J. Comput. Nonlinear Dynam. 13 (2018) 041007 (the claims
    of the abstract); Agrawal and Shabana, Comput. Struct. 21 (1985) 1303, for the mean axis.
"""

from dataclasses import replace

import numpy as np

from rom.body.records import Body, BodyData, Marker, motion_of
from rom.errors import ConfigError, ModelError
from rom.model import Array, moved_rigidly
from rom.names import named
from rom.plausible import far_doubt
from rom.rotation import crossed, skew, skew_tensor

# The frame of Tisserand carries no momentum of the deformation, that of Buckens keeps its mean
# square smallest; linearised, both say that the shapes are orthogonal to rigid motion in the mass.
MEAN_AXES = ("mean-axis", "buckens", "free")


def reference_motion(body: BodyData, reference: object) -> Array:
    """(6, r) rigid motion X hidden in each shape, as the reference condition sees it."""
    if isinstance(reference, str) and reference in MEAN_AXES:
        from_rigid, from_shapes = rigid_mass(body), rigid_elastic(body)
    elif isinstance(reference, str):
        from_rigid, from_shapes = marker_motion(body.marker(reference), body.n_modes)
    elif isinstance(reference, tuple | list) and len(reference) in (2, 3):
        condition = _pins if len(reference) == 2 else _three_two_one
        from_rigid, from_shapes = condition([body.marker(x) for x in reference], body.n_modes)
    else:
        known = f'"mean-axis", "buckens", or one to three of {sorted(body.markers)}'
        raise ConfigError(f"reference = {reference!r} is not a reference condition: use {known}.")
    scale = np.r_[np.ones(3), np.full(3, 1 / body.size)]
    if np.linalg.cond(from_rigid * scale) > 1e12:
        distance = float(np.linalg.norm(body.first_moment)) / body.mass
        away = far_doubt(distance, body.size, "the body")
        hint = away or "Pins must not coincide, three points not lie on one line."
        raise ModelError(f"reference = {reference!r} leaves the frame undetermined.", hint=hint)
    return np.linalg.solve(from_rigid, from_shapes)


def rigid_marker(name: str, point: Array, translation: Array, rotation: Array) -> Marker:
    """An interface that is rigid: its six coordinates are its motion."""
    hold = np.hstack([moved_rigidly(point), np.vstack([translation, rotation])])
    return Marker(name, point, translation, rotation, "rbe2", hold)


def marker_motion(marker: Marker, r: int) -> tuple[Array, Array]:
    """The six motions of a marker under rigid motions and under the shapes."""
    return moved_rigidly(marker.point), motion_of(marker).reshape(6, r)


def _pins(points: list[Marker], r: int) -> tuple[Array, Array]:
    """Chord frame: first point fixed, second on the axis, no mean twist at the first point."""
    first, second = points
    axis = second.point - first.point
    length = np.linalg.norm(axis)
    if length == 0.0:
        raise ModelError(f"pins {first.name!r} and {second.name!r} lie in the same point.")
    axis = axis / length
    across = np.linalg.svd(axis[None])[2][1:]
    rigid, elastic = (
        np.vstack([one[:3], across @ other[:3], axis @ one[3:]])
        for one, other in zip(marker_motion(first, r), marker_motion(second, r), strict=True)
    )
    return rigid, elastic


def _three_two_one(points: list[Marker], r: int) -> tuple[Array, Array]:
    """Simply supported: first point fixed, second on a line, third on a plane through all three."""
    first, second, third = points
    axis = second.point - first.point
    normal = np.cross(axis, third.point - first.point)
    size = max(np.linalg.norm(axis), np.linalg.norm(third.point - first.point))
    if np.linalg.norm(normal) < 1e-9 * size**2 or size == 0.0:
        raise ModelError(f"{named(p.name for p in points)} lie on one line; span a plane.")
    axis, normal = axis / np.linalg.norm(axis), normal / np.linalg.norm(normal)
    across = np.array([normal, np.cross(normal, axis)])
    rigid, elastic = (
        np.vstack([one[:3], across @ other[:3], normal @ last[:3]])
        for one, other, last in zip(*(marker_motion(x, r) for x in points), strict=True)
    )
    return rigid, elastic


def rigid_mass(body: BodyData) -> Array:
    """(6, 6) mass of the undeformed body: translation, rotation about the origin."""
    skew_d = skew(body.first_moment)
    return np.block([[body.mass * np.eye(3), -skew_d], [skew_d, body.inertia]])


def rigid_elastic(body: BodyData) -> Array:
    """(6, r) coupling of rigid and elastic coordinates: momentum and angular momentum of shapes."""
    return np.vstack([body.S, crossed(body.Ibar_kl)])


def moved_frame(body: Body, X: Array) -> Body:
    """The body with shapes phi_k - (t_k + w_k x X), X = [t; w] (6, r), and its old K_geo."""
    t, W, P = X[:3], turns_of(X), second_moment(body)
    Wd = np.einsum("abk,b->ak", W, body.first_moment)
    S, Ibar = moved_integrals(body, X)
    cross = np.einsum("ak,bl->abkl", body.S, t) + np.einsum("cak,bcl->abkl", body.Ibar_kl, W)
    rigid = body.mass * np.einsum("ak,bl->abkl", t, t) + np.einsum("ak,bl->abkl", t, Wd)
    rigid += np.einsum("ak,bl->abkl", Wd, t)
    rigid += np.einsum("ack,cd,bdl->abkl", W, P, W, optimize=True)
    S_kl = body.S_kl - cross - cross.transpose(1, 0, 3, 2) + rigid
    surface = body.surface
    if surface is not None:
        shift = t[None] + np.einsum("abk,nb->nak", W, surface.points)
        surface = replace(surface, shape=surface.shape - shift.reshape(surface.shape.shape))
    markers = {name: moved_marker(marker, X) for name, marker in body.markers.items()}
    return replace(body, S=S, Ibar_kl=Ibar, S_kl=S_kl, markers=markers, surface=surface)


def moved_integrals(body: BodyData, X: Array) -> tuple[Array, Array]:
    """Integrals S (3, r) and Ibar_kl (3, 3, r) of the shapes without the rigid motion X (6, r)."""
    t, W, d = X[:3], turns_of(X), body.first_moment
    S = body.S - body.mass * t - np.einsum("abk,b->ak", W, d)
    Ibar = body.Ibar_kl - np.einsum("a,bk->abk", d, t)
    return S, Ibar - np.einsum("ac,bck->abk", second_moment(body), W)


def moved_marker(marker: Marker, X: Array) -> Marker:
    """The marker without the rigid motion X (6, r)."""
    return replace(
        marker,
        translation=marker.translation - X[:3] - np.einsum("abk,b->ak", turns_of(X), marker.point),
        rotation=marker.rotation - X[3:],
        hold=np.hstack([marker.hold[:, :6], marker.hold[:, 6:] - marker.hold[:, :6] @ X]),
    )


def second_moment(body: BodyData) -> Array:
    """(3, 3) integral of rho x x^T over the undeformed body."""
    return 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia


def turns_of(X: Array) -> Array:
    """(3, 3, k) W of rigid motions X (6, k), for which W[:, :, k] @ x = w_k x x."""
    return np.einsum("abc,ck->abk", skew_tensor(), X[3:])
