"""Pictures of a whole wheel from the surface of one sector."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import typed
from rom.deprecated import path_came_first
from rom.errors import ConfigError
from rom.model import Array, FEModel, Index, SurfaceMesh
from rom.view.canvas import page
from rom.view.scenes.mode_shapes import drawn, sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COINCIDENT_RTOL = 1e-6  # of the wheel's size: nodes of neighbouring sectors


@path_came_first(1, 2, 0)
@typed
def wheel_modes(  # noqa: PLR0913  keywords of one picture
    model: FEModel,
    shapes: Mapping[str, npt.ArrayLike],
    path: str | Path | None = None,
    *,
    title: str,
    caption: str,
    hidden: tuple[str, ...] = ("cyclic_low", "cyclic_high"),
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    view: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw modes of a wheel on its deformed surface.

    Args:
        model: one sector, with its surface.
        shapes: {name: (N, 3 k) displacements of the k nodes of each sector, axes of the wheel, in
            units of any length}.
        path: picture to write, .png; None to write nothing.
        title: heading.
        caption: what a stranger has to know.
        hidden: interfaces inside the wheel, not drawn.
        axis: (3,) axis of the wheel, through the origin of coordinates [1].
        view: (3,) direction from the wheel to the eye [1].

    Raises:
        ConfigError: if there is nothing to draw, or pictures cannot be made here.
    """
    path = page.wanted(path)
    if model.surface is None or not shapes:
        raise ConfigError("there is no surface, or no mode of the wheel, to draw.")
    U = [np.asarray(u, dtype=float) for u in shapes.values()]
    N = U[0].shape[0]
    if any(u.shape != (N, 3 * model.points.shape[0]) for u in U):
        raise ConfigError(f"each shape needs {3 * model.points.shape[0]} numbers per sector.")
    nodes, triangles = _outside(model, model.surface, hidden)
    e = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    turns = [rotation.matrix(rotation.exp(2 * np.pi * j / N * e)) for j in range(N)]
    points = np.vstack([model.points[nodes] @ R.T for R in turns])
    first, whole = _joined(points, np.vstack([triangles + j * nodes.size for j in range(N)]))
    moved: list[Array] = [u.reshape(N, -1, 3)[:, nodes].reshape(-1, 3)[first] for u in U]
    surface = SimpleNamespace(points=points[first], triangles=whole)
    images, camera = drawn(surface, moved, view, None)
    with page.styled():
        return page.save(sheet(images, camera, list(shapes), title, caption, "wheel"), path)


def _outside(model: FEModel, surface: SurfaceMesh, hidden: tuple[str, ...]) -> tuple[Index, Index]:
    """Nodes of the model on the outer surface of the wheel, and triangles between them."""
    inside = np.zeros(len(surface.triangles), dtype=np.bool_)
    for name in hidden:
        inside |= np.isin(surface.nodes[surface.triangles], model.interfaces[name].nodes).all(1)
    used, triangles = np.unique(surface.triangles[~inside], return_inverse=True)
    return surface.nodes[used], triangles.reshape(-1, 3)


def _joined(points: Array, triangles: Index) -> tuple[Index, Index]:
    """One of each group of points in the same place, and the triangles between these."""
    grid = np.round(
        points / (COINCIDENT_RTOL * np.ptp(points)) + 0.381966
    )  # away from round coordinates
    _, first, place = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return first, place.ravel()[triangles]
