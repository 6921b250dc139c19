"""Sensors and forces on a body: points, directions, and how far off its surface they lie."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, typed
from rom.errors import ConfigError
from rom.model import Array
from rom.view.canvas.solids import Mesh, ellipsoid, joined, tube
from rom.view.figures.things import Scene, Thing

BALL_SIZE, ARROW_SIZE, GAP_WIDTH = 0.012, 0.09, 0.003  # of the body's length
BODY_COLOUR, BODY_OPACITY = "#c3c9d0", 0.55


@typed
def channels(
    surface: Mesh,
    several: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    *,
    title: str = "",
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Scene:
    """A body with channels on it, to be drawn by `plane`, alone or beside diagrams.

    A ball is where a channel was given, its bar the direction; a thin line leads from there to the
    point of the surface that is taken for it.

    Args:
        surface: points (s, 3) [m] and triangles of the body.
        several: {name: (points (k, 3) [m], directions (k, 3) [1])}, of a plan or a test.
        title: above the picture.
        view: see `Scene`.
        up: see `Scene`.

    Raises:
        ConfigError: for a group of another shape, or a direction of length zero.

    Example:
        >>> body = rom.load("beam.rom.npz")
        >>> on = body.surface.points[:2], [[0, 1, 0], [0, 0, 1]]
        >>> scene = rom.view.channels((body.surface.points, body.surface.triangles), {"test": on})
        >>> list(scene.things)
        ['body', 'test']
    """
    points, triangles = np.asarray(surface[0], dtype=float), surface[1]
    size = float(np.ptp(points, axis=0).max())
    things: dict[str, Thing | Mesh] = {
        "body": Thing(points, triangles, BODY_COLOUR, opacity=BODY_OPACITY)
    }
    for name, (where, along) in several.items():
        x, d = (np.atleast_2d(finite(name, A, None)) for A in (where, along))
        if x.shape != d.shape or x.shape[1:] != (3,) or not np.linalg.norm(d, axis=1).all():
            raise ConfigError(
                f"{name!r}: {x.shape} points, {d.shape} directions; give (k, 3) of both."
            )
        things[name] = joined([part for k in range(len(x)) for part in _channel(x[k], d[k], size)])
        gaps = [gap for p in x if (gap := _gap(p, points, size)) is not None]
        if gaps:
            things[f"{name}, off the surface"] = joined(gaps)
    return Scene(title, things, view=view, up=up)


def _channel(x: Array, d: Array, size: float) -> list[Any]:
    end = x + ARROW_SIZE * size * d / np.linalg.norm(d)
    ball = ellipsoid((BALL_SIZE * size,) * 3, x, sides=12)
    return [ball, tube([x, end], 0.7 * BALL_SIZE * size, sides=8)]


def _gap(x: Array, points: Array, size: float) -> Any:
    """A line to the nearest point of the surface, unless it is hidden in the ball."""
    near = points[np.linalg.norm(points - x, axis=1).argmin()]
    if np.linalg.norm(near - x) <= BALL_SIZE * size:
        return None
    return tube([x, near], GAP_WIDTH * size, sides=6)
