"""Pictures of natural modes on the deformed surface: of a body, or a wheel from its sectors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import AnyBody, typed
from rom.errors import ConfigError
from rom.model import Array, FEModel, Index
from rom.view.canvas import page
from rom.view.canvas.scene import UNDEFORMED_COLOUR, sharp_edges
from rom.view.canvas.solids import joined
from rom.view.figures.things import NO_LINES, STILL_WIDTH, Scene, Thing, seen, series_page
from rom.view.scenes.meshes import surface_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AMPLITUDE_RATIO = 0.08  # largest displacement shown, of the body's size
COINCIDENT_RTOL = 1e-6  # of the wheel's size: nodes of neighbouring sectors


@typed
@page.picture
def mode_shapes(
    body: AnyBody,
    path: str | Path | None = None,
    *,
    n: int = 6,
    fixed: tuple[str, ...] = (),
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw the lowest elastic modes of a flexible body.

    Args:
        body: a `FlexibleBody` with a surface.
        path: picture to write, .png; None to write nothing.
        n: number of modes.
        fixed: names of the interfaces held; the body is free when there are none.
        view: (3,) direction from the body to the eye [1]; None: mainly along its shortest extent.
        up: (3,) upright direction [1]; None: across its longest extent.

    Raises:
        ConfigError: if the body has no surface, or pictures cannot be made here.
        InterfaceError: if an interface is unknown.
    """
    body = body.in_units("SI")
    shapes = elastic_shapes(body, n, fixed)
    support = f"{' and '.join(fixed)} held" if fixed else "free, its six rigid motions left out"
    words = (
        f"Lowest elastic modes of the reduced body {body.name} ({body.n_modes} elastic "
        f"coordinates), {support}."
    )
    title = f"Mode shapes of {body.name}"
    return modes_page(body.surface, shapes, title, words, what="body", view=view, up=up)


def elastic_shapes(body: AnyBody, n: int, fixed: tuple[str, ...]) -> dict[str, Array]:
    """{number and frequency: (s, 3) displacement of the surface} of the lowest elastic modes."""
    surface_of(body)
    omega, V = body.modes(fixed=fixed)
    return {
        f"mode {i}: {omega[k] / (2 * np.pi):.5g} Hz": displacement(body, V[:, k])
        for i, k in enumerate(np.flatnonzero(omega > 0)[:n], start=1)
    }


def displacement(body: AnyBody, motion: Array) -> Array:
    """(s, 3) displacement of the surface for a motion (6 + r,): rigid coordinates first."""
    X = body.surface.points
    rigid = motion[:3] + np.cross(motion[3:6], X)
    return rigid + (body.surface.shape @ motion[6:]).reshape(-1, 3)


def modes_page(
    surface: Any, shapes: Mapping[str, Array], title: str, words: str, *, what: str, **look: Any
) -> "Figure":
    """A page of modes, {name: (s, 3) displacements of a surface}, seen as a `Scene` is.

    Displacements are compared with the size of ``what``, which the caption adds to the words.
    """
    X, size = surface.points, np.ptp(surface.points, axis=0).max()
    lengths = np.array([np.linalg.norm(u, axis=1) for u in shapes.values()])
    largest = lengths.max(axis=1, keepdims=True)
    moved = X + AMPLITUDE_RATIO * size * np.array([*shapes.values()]) / largest[..., None]
    still = Thing(X, sharp_edges(X, surface.triangles), UNDEFORMED_COLOUR, width=1.0)
    body = Thing(moved, surface.triangles, values=lengths / largest, edges=NO_LINES)
    label = "displacement / largest displacement of the mode"
    scene = Scene(title, {"_still": still, "body": body}, label, limits=(0.0, 1.0), **look)
    caption = (
        f"{words} The largest displacement is drawn as {100 * AMPLITUDE_RATIO:g} % of the size of "
        f"the {what}; grey lines show the undeformed edges."
    )
    return series_page(seen(scene, STILL_WIDTH), list(shapes), caption)


@typed
@page.picture
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
    surface_of(model)
    if not shapes:
        raise ConfigError("at least one mode of the wheel is needed to draw.")
    U = [np.asarray(u, dtype=float) for u in shapes.values()]
    N = U[0].shape[0]
    if any(u.shape != (N, 3 * model.points.shape[0]) for u in U):
        raise ConfigError(f"each shape needs {3 * model.points.shape[0]} numbers per sector.")
    around = _around([model] * N, hidden, axis, range(N))
    moved = {name: around.displaced(list(u)) for name, u in zip(shapes, U, strict=True)}
    return modes_page(around, moved, title, caption, what="wheel", view=view)


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
        models: of the sectors around the axis in order, each as if it were the first one.
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
        given = [one.size for one in u]
        raise ConfigError(f"the shape has {given} numbers per sector, needed are {sizes}.")
    moved = around.displaced(u)
    values = scale * np.linalg.norm(moved, axis=1)
    return Thing(around.points + magnify * moved, around.triangles, values=values)


@dataclass(frozen=True, slots=True)
class Around:
    """The outer surface of sectors in their places."""

    nodes: list[Index]  # of each sector that lie on it
    first: Index  # (n,) which of all these nodes the points are
    points: Array  # (n, 3) [m]
    triangles: Index  # (t, 3) between them

    def displaced(self, u: Sequence[Array]) -> Array:
        """(n, 3) displacements of the points, from (3 k,) those of each sector."""
        parts = [one.reshape(-1, 3)[nodes] for one, nodes in zip(u, self.nodes, strict=True)]
        return np.vstack(parts)[self.first]


def _around(
    models: Sequence[FEModel], hidden: tuple[str, ...], axis: npt.ArrayLike, sectors: Sequence[int]
) -> Around:
    e = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    outside = {id(m): _outside(m, hidden) for m in models}
    nodes, pieces = [], []
    for j in sectors:
        own, triangles = outside[id(models[j])]
        turn = rotation.matrix(rotation.exp(2 * np.pi * j / len(models) * e))
        nodes.append(own)
        pieces.append((models[j].points[own] @ turn.T, triangles))
    points, every = joined(pieces)
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
    away = 0.381966  # from round coordinates
    grid = np.round(points / (COINCIDENT_RTOL * np.ptp(points)) + away)
    _, first, place = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return first, place.ravel()[triangles]
