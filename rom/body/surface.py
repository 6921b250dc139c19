"""The outer surface of a body: places on it and their areas."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rom.body.records import BodyData, Surface
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index

Where = Callable[[Array], Any] | str | None
COINCIDENT_RTOL = 1e-9  # of the body's size


def surface_of(body: BodyData) -> Surface:
    """The surface of a body.

    Raises:
        ModelError: if it carries none.
    """
    if body.surface is None:
        raise ModelError(
            f"body {body.name!r} carries no surface: nothing to spread a load on.",
            hint="Reduce a model that has one; imported matrices have none.",
        )
    return body.surface


def point_areas(body: BodyData, where: Where = None) -> Array:
    """(s,) a third of the area of the chosen triangles around each point of the surface [m^2]."""
    chosen, areas = chosen_triangles(body, where)
    out = np.zeros(surface_of(body).points.shape[0])
    np.add.at(out, chosen.ravel(), np.repeat(np.linalg.norm(areas, axis=1) / 3, 3))
    return out


def chosen_triangles(body: BodyData, where: Where) -> tuple[Index, Array]:
    """(t, 3) corners of the chosen triangles and their areas times the normal (t, 3)."""
    surface = surface_of(body)
    chosen = surface.triangles[_chosen(body, where)]
    a, b, c = np.moveaxis(surface.points[chosen], 1, 0)
    return chosen, 0.5 * np.cross(b - a, c - a)


def _chosen(body: BodyData, where: Where) -> Any:
    """(t,) which triangles are meant."""
    surface = surface_of(body)
    corners = surface.points[surface.triangles]
    if where is None:
        chosen = np.ones(len(corners), dtype=bool)
    elif isinstance(where, str):
        chosen = _on_interface(body, where)[surface.triangles].all(axis=1)
    else:
        chosen = np.asarray(where(corners.mean(axis=1)))
    if chosen.shape != (len(corners),) or chosen.dtype != bool or not chosen.any():
        raise ConfigError(
            f"`where` chooses no triangle of the {len(corners)} on body {body.name!r}.",
            hint="It takes (t, 3) points and returns (t,) booleans.",
        )
    return chosen


def _on_interface(body: BodyData, name: str) -> Any:
    """(s,) whether the points of the surface belong to a deformable interface."""
    patch = body.markers[name].patch if name in body.markers else None
    if patch is None:
        raise ConfigError(
            f"body {body.name!r} has no deformable interface {name!r}.",
            hint="Choose the place by a function of points.",
        )
    surface = surface_of(body)
    grid = COINCIDENT_RTOL * max(float(np.ptp(surface.points, axis=0).max()), 1e-300)
    known = {tuple(x) for x in np.round(patch.points / grid / 100).astype(int)}
    return np.array([tuple(x) in known for x in np.round(surface.points / grid / 100).astype(int)])
