"""The outer surface of a body: places on it, their areas and strains."""

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from rom.body.records import BodyData, Surface
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index, Mask

Where = Callable[[Array], npt.ArrayLike] | str | None
COINCIDENT_RTOL = 1e-7  # of the body's size
GAUGE_RTOL = 0.02  # distance of a strain gauge from the surface, of the body's size
MAX_TILT = 0.2  # sine of the angle between a strain gauge and the surface; facets of a round one


def surface_of(body: BodyData) -> Surface:
    """The surface of a body, which has to carry one."""
    if body.surface is None:
        raise ModelError(f"body {body.name!r} carries no surface; reduce a model that has one.")
    return body.surface


def one_surface(parts: list[Surface | None]) -> Surface | None:
    """All surfaces in one; None unless every part has one."""
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    first = np.cumsum([0, *(len(part.points) for part in known)])
    triangles = [part.triangles + n for part, n in zip(known, first[:-1], strict=True)]
    points, shapes = ([getattr(part, x) for part in known] for x in ("points", "shape"))
    return Surface(np.vstack(points), np.vstack(triangles), np.vstack(shapes))


def point_areas(body: BodyData, where: Where = None) -> Array:
    """(s,) a third of the area of the chosen triangles around each point of the surface [m^2]."""
    chosen, areas = chosen_triangles(body, where)
    out = np.zeros(surface_of(body).points.shape[0])
    np.add.at(out, chosen.ravel(), np.repeat(np.linalg.norm(areas, axis=1) / 3, 3))
    return out


def chosen_triangles(body: BodyData, where: Where) -> tuple[Index, Array]:
    """(t, 3) corners of the chosen triangles and their areas times the normal (t, 3)."""
    surface = surface_of(body)
    triangles, corners = surface.triangles, surface.points[surface.triangles]
    if where is None:
        chosen = np.ones(len(corners), dtype=bool)
    elif isinstance(where, str):
        chosen = _on_interface(body, where)[triangles].all(axis=1)
    else:
        chosen = np.asarray(where(corners.mean(axis=1)))
    if chosen.shape != (len(corners),) or chosen.dtype != bool or not chosen.any():
        text = f"`where` chooses no triangle of the {len(corners)} on body {body.name!r}"
        raise ConfigError(f"{text}; it takes (t, 3) points and returns (t,) booleans.")
    a, b, c = np.moveaxis(corners[chosen], 1, 0)
    return triangles[chosen], 0.5 * np.cross(b - a, c - a)


def strain_rows(
    body: BodyData,
    points: npt.ArrayLike,
    directions: npt.ArrayLike,
    what: str,
    numbers: Iterable[object] | None = None,
) -> Array:
    """(k, r) normal strain along directions in the surface per elastic coordinate [1/m].

    It is that of the triangle in which the point lies. Gauges at points (k, 3) [m] along directions
    (k, 3), which messages call ``what`` with its entry in ``numbers``, must lie on the surface.
    """
    surface = surface_of(body)
    corners = surface.points[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    reach = GAUGE_RTOL * float(np.ptp(surface.points, axis=0).max())
    found, shapes = [], surface.shape.reshape(len(surface.points), 3, -1)
    at, along = np.asarray(points), np.asarray(directions)
    numbers = range(len(at)) if numbers is None else numbers
    for k, x, d in zip(numbers, at, along, strict=True):
        d = d / np.linalg.norm(d)
        lies = np.flatnonzero(np.abs(normals @ d) <= MAX_TILT)
        far = _distances(x, corners[lies])
        if not lies.size or far.min() > reach:
            text = f"{what} {k} at {x.tolist()} along {d.round(4).tolist()} lies on no face of body"
            hint = "Strain is measured along the surface; compare axes and units with the mesh."
            raise ConfigError(f"{text} {body.name!r} within {reach:.3g} m.", hint=hint)
        t = int(lies[far.argmin()])
        d = d - normals[t] * (normals[t] @ d)
        d = d / np.linalg.norm(d)
        shape = shapes[surface.triangles[t]]
        # weights of the corners that give the derivative along d of any linear function
        weights = np.linalg.pinv(np.vstack([np.ones(3), corners[t].T - x[:, None]])) @ np.r_[0.0, d]
        found.append(np.einsum("c,i,cir->r", weights, d, shape))
    return np.array(found).reshape(-1, surface.shape.shape[1])


def _distances(x: Array, corners: Array) -> Array:
    """(t,) distance of a point from triangles (t, 3, 3)."""
    a, b, c = np.moveaxis(corners - x, 1, 0)
    u, v = b - a, c - a
    n = np.cross(u, v)
    size = np.maximum(np.einsum("ti,ti->t", n, n), 1e-300)
    s = np.einsum("ti,ti->t", np.cross(-a, v), n) / size
    r = np.einsum("ti,ti->t", np.cross(u, -a), n) / size
    inside = (s >= 0) & (r >= 0) & (s + r <= 1)
    height = np.abs(np.einsum("ti,ti->t", a, n)) / np.sqrt(size)
    edges = np.min([_to_line(p, q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return np.where(inside, height, edges)


def _to_line(p: Array, q: Array) -> Array:
    """(t,) distance of the origin from lines between points p and q (t, 3)."""
    along = q - p
    size = np.maximum(np.einsum("ti,ti->t", along, along), 1e-300)
    at = np.clip(-np.einsum("ti,ti->t", p, along) / size, 0.0, 1.0)
    return np.linalg.norm(p + at[:, None] * along, axis=1)


def _on_interface(body: BodyData, name: str) -> Mask:
    """(s,) whether the points of the surface belong to a deformable interface."""
    patch = body.markers[name].patch if name in body.markers else None
    if patch is None:
        text = f"body {body.name!r} has no deformable interface {name!r}"
        raise ConfigError(f"{text}; choose the place by a function of points.")
    points = surface_of(body).points
    return cKDTree(patch.points).query(points)[0] <= COINCIDENT_RTOL * np.ptp(points, axis=0).max()
