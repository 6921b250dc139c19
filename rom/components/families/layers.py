"""Layers that change their thickness: how points, rigid motions and a family's bodies follow.

Stretched by factors s_j, a point of the nominal body moves along one axis to::

    x' = X(x) + sum_j s_j g_j(x) e,   g_j: length inside the layers j between the origin and x

so that points, and with them rigid motions and all inertia integrals, are polynomials in the
factors whose coefficients are integrals over the nominal body. Interfaces stay rigid, which is one
more condition on the coordinates at each point: it selects the motions of a face that are rigid for
the thickness it has there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import null_space

from rom.body.flexible import FlexibleBody
from rom.body.inertia import InertiaIntegrals
from rom.body.records import Marker, Surface
from rom.body.reference import rigid_marker
from rom.components.families.parameters import Parameter, Point, Thickness, factor
from rom.eigen.verbs import rigid_motions
from rom.model import Array

ROUND_OFF = 1e-12  # of the largest distance from the origin: no length outside the layers


@dataclass(frozen=True, slots=True)
class Stretch:
    """Layers along one axis."""

    axis: int  # 0, 1 or 2
    regions: tuple[str, ...]  # regions whose thickness is a parameter
    layers: tuple[tuple[tuple[float, float], ...], ...]  # per region (low, high) [m]
    # (2 + number of regions, 6 + r, 6) rigid motions of the fields in the coordinates of the
    # family, see `fields`; empty until they are known
    rigid: Array = field(default_factory=lambda: np.zeros((0, 0, 6)))

    def fields(self, points: Array) -> Array:
        """(2 + number of regions, k, 3): the part that stays, outside all layers, in each region.

        Points are nominal positions (k, 3) [m].
        """
        x = points[:, self.axis]
        lengths = [
            sum(np.clip(x, *ends) - np.clip(0.0, *ends) for ends in intervals)
            for intervals in self.layers
        ]
        X = np.zeros((2 + len(lengths), *points.shape))
        X[0] = points
        X[0, :, self.axis] = 0.0
        outside = x - sum(lengths)
        outside[np.abs(outside) < ROUND_OFF * np.abs(x).max(initial=0.0)] = 0.0
        X[1:, :, self.axis] = [outside, *lengths]
        return X

    def weights(self, parameters: dict[str, Parameter], point: Point) -> Array:
        """(2 + number of regions,) factors of the fields."""
        slopes = [factor(parameters, Thickness, r, point) for r in (None, *self.regions)]
        return np.array([1.0, *slopes])

    def mapped(self, points: Array, weights: Array) -> Array:
        """(k, 3) where nominal points are."""
        return np.einsum("j,jka->ka", weights, self.fields(points))

    def motions(self, points: Array) -> list[Array]:
        """(3k, 6) rigid motions of each field; their weighted sum is that of the mapped points."""
        parts = [rigid_motions(X) for X in self.fields(points)]
        for R in parts[1:]:
            R[:, :3] = 0.0
        return parts


def stretched_body(
    body: FlexibleBody,
    stretch: Stretch,
    terms: tuple[Sequence[InertiaIntegrals], Sequence[Array]],
    factors: tuple[Array, Array, Array],
    weights: tuple[Array, Array],
) -> FlexibleBody:
    """The body at some factors, with rigid interfaces, seen from its mean axes.

    Terms are per region the integrals over [fields, rigid motions at the centre, shapes], and the
    stiffness (3, 6 + r, 6 + r) of rigid motions and shapes; factors are those of stiffness, mass
    and thickness per region, weights those of the fields at this point and at the centre.
    """
    (integrals, stiffness), (k, m, t), (w, at_centre) = terms, factors, weights
    n = w.size
    mass = float((m * t) @ [part.mass for part in integrals])
    S, S_kl = (
        np.sum([c * getattr(part, name) for c, part in zip(m * t, integrals, strict=True)], axis=0)
        for name in ("S", "S_kl")
    )
    each = zip(k, t, stiffness, strict=True)
    K = np.sum([c * (s * A[0] + A[1] + A[2] / s) for c, s, A in each], axis=0)
    R = np.einsum("j,jkl->kl", w, stretch.rigid)
    Y = _coordinates(body, R, np.einsum("aakl->kl", S_kl[:, :, n:, n:]))
    second = np.einsum("abij,i,j->ab", S_kl[:, :, :n, :n], w, w)
    shapes = np.einsum("abkl,km,ln->abmn", S_kl[:, :, n:, n:], Y, Y, optimize=True)
    elastic, surface = Y.T @ K @ Y, body.surface
    if surface is not None:
        points, middle = (stretch.mapped(surface.points, at) for at in (w, at_centre))
        shape = np.hstack([rigid_motions(middle), surface.shape]) @ Y
        surface = Surface(points, surface.triangles, shape)
    return replace(
        body,
        mass=mass,
        first_moment=S[:, :n] @ w,
        inertia=np.trace(second) * np.eye(3) - second,
        S=S[:, n:] @ Y,
        Ibar_kl=np.einsum("abik,i,kl->abl", S_kl[:, :, :n, n:], w, Y, optimize=True),
        S_kl=0.5 * (shapes + shapes.transpose(1, 0, 3, 2)),
        K=0.5 * (elastic + elastic.T),
        D=np.zeros_like(elastic),
        markers={
            name: _marker(marker, stretch.mapped(marker.point[None], w)[0], R, Y)
            for name, marker in body.markers.items()
        },
        surface=surface,
    )


def _coordinates(body: FlexibleBody, R: Array, M: Array) -> Array:
    """(6 + r, r') motions that keep the interfaces rigid, as markers know them, without momentum.

    By rigid motions (6 + r, 6) and mass (6 + r, 6 + r).
    """
    scale = 1 / np.sqrt(np.diag(M))
    rows = []
    for marker in body.markers.values():
        bent = np.linalg.qr(marker.hold @ R, mode="complete")[0][:, 6:]
        C = bent.T @ marker.hold * scale
        rows.append(C / np.linalg.norm(C, axis=1, keepdims=True))
    C = np.vstack(rows)
    N = scale[:, None] * (null_space(C, rcond=1e-10) if C.size else np.eye(scale.size))
    momentum = R.T @ M @ N
    return N @ null_space(momentum / np.linalg.norm(momentum, axis=1, keepdims=True))


def _marker(marker: Marker, point: Array, R: Array, Y: Array) -> Marker:
    """A rigid face: its motion in the rigid motions about the origin, then at the point."""
    rigid = rigid_marker(marker.name, point, *np.zeros((2, 3, 0))).hold
    motion = rigid @ np.linalg.lstsq(marker.hold @ R, marker.hold @ Y, rcond=None)[0]
    return rigid_marker(marker.name, point, motion[:3], motion[3:])
