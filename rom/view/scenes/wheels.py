"""Pictures of a whole wheel from the surface of one sector."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import typed
from rom.errors import ConfigError
from rom.model import Array, FEModel, Index
from rom.view.canvas import page
from rom.view.figures.things import Thing
from rom.view.scenes.meshes import surface_of
from rom.view.scenes.mode_shapes import modes_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COINCIDENT_RTOL = 1e-6  # of the wheel's size: nodes of neighbouring sectors


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
    surface_of(model)
    if not shapes:
        raise ConfigError("at least one mode of the wheel is needed to draw.")
    U = [np.asarray(u, dtype=float) for u in shapes.values()]
    N = U[0].shape[0]
    if any(u.shape != (N, 3 * model.points.shape[0]) for u in U):
        raise ConfigError(f"each shape needs {3 * model.points.shape[0]} numbers per sector.")
    around = _around([model] * N, hidden, axis)
    moved = {name: around.displaced(list(u)) for name, u in zip(shapes, U, strict=True)}
    return page.save(modes_page(around, moved, title, caption, what="wheel", view=view), path)


@typed
def wheel(
    models: Sequence[FEModel],
    *,
    shape: Sequence[npt.ArrayLike] | None = None,
    sectors: Sequence[int] | None = None,
    magnify: float = 1.0,
    scale: float = 1.0,
    hidden: tuple[str, ...] = ("cyclic_low", "cyclic_high"),
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
) -> Thing:
    """A wheel, or some of its sectors, as a thing of a `Scene`.

    Args:
        models: of the sectors, one after the other around the axis, each as if it were the first
            one.
        shape: (3 k,) displacements of the k nodes of each sector drawn, axes of the wheel [m],
            whose sizes the colours show; None for one colour.
        sectors: numbers of those that are drawn; None for all.
        magnify: displacements are drawn so many times larger than they are [1].
        scale: of the values that colours show, per metre.
        hidden: interfaces inside the wheel, not drawn.
        axis: (3,) axis of the wheel, through the origin of coordinates [1].

    Raises:
        ConfigError: if there is no surface, or the shape does not fit.
    """
    chosen = list(range(len(models)) if sectors is None else sectors)
    if not chosen or not all(0 <= j < len(models) for j in chosen):
        raise ConfigError(f"sectors {chosen} must be from 0 to {len(models) - 1}.")
    around = _around(models, hidden, axis, chosen)
    if shape is None:
        return Thing(around.points, around.triangles)
    u = [np.asarray(one, dtype=float).ravel() for one in shape]
    sizes = [3 * len(models[j].points) for j in chosen]
    if [one.size for one in u] != sizes:
        raise ConfigError(f"the shape has {[one.size for one in u]} numbers per sector, "
                          f"needed are {sizes}.")  # fmt: skip
    moved = around.displaced(u)
    values = scale * np.linalg.norm(moved, axis=1)
    return Thing(around.points + magnify * moved, around.triangles, values=values)


@dataclass(frozen=True, slots=True)
class Around:
    """The outer surface of sectors in their places.

    Attributes:
        nodes: of each sector that lie on it.
        first: (n,) which of all these nodes the points are.
        points: (n, 3) [m].
        triangles: (t, 3) between them.
    """

    nodes: list[Index]
    first: Index
    points: Array
    triangles: Index

    def displaced(self, u: Sequence[Array]) -> Array:
        """(n, 3) displacements of the points, from (3 k,) those of each sector."""
        parts = [one.reshape(-1, 3)[nodes] for one, nodes in zip(u, self.nodes, strict=True)]
        return np.vstack(parts)[self.first]


def _around(
    models: Sequence[FEModel],
    hidden: tuple[str, ...],
    axis: npt.ArrayLike,
    sectors: Sequence[int] | None = None,
) -> Around:
    e = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    outside = {id(m): _outside(m, hidden) for m in models}
    chosen = range(len(models)) if sectors is None else sectors
    turns = [rotation.matrix(rotation.exp(2 * np.pi * j / len(models) * e)) for j in chosen]
    nodes = [outside[id(models[j])][0] for j in chosen]
    triangles = [outside[id(models[j])][1] for j in chosen]
    starts = np.cumsum([0, *(n.size for n in nodes)])[:-1]
    points = np.vstack([models[j].points[n] @ R.T
                        for j, n, R in zip(chosen, nodes, turns, strict=True)])  # fmt: skip
    every = np.vstack([t + start for t, start in zip(triangles, starts, strict=True)])
    first, whole = _joined(points, every)
    return Around(nodes, first, points[first], whole)


def _outside(model: FEModel, hidden: tuple[str, ...]) -> tuple[Index, Index]:
    """Nodes of the model on the outer surface of the wheel, and triangles between them."""
    surface = surface_of(model)
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
