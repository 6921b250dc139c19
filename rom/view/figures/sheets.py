"""Plane bodies of triangles: figures and films of how they deform."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.deprecated import path_came_first
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.gif import write_gif
from rom.view.canvas.offscreen import COLOUR_MAP
from rom.view.figures.curves import LINES, MARKERS, finish

PAGE_WIDTH, PANEL_HEIGHT = 1500, 430  # pixel
FILM_SIZE = (640, 700)  # of the picture in a film [pixel]
SURFACE_COLOUR, EDGE_COLOUR, UNDEFORMED_COLOUR = "#dfe5ec", "#6b7480", "#d1495b"


@typed
@dataclass(frozen=True, slots=True)
class Shape:
    """A plane body as it is now.

    Attributes:
        title: what is seen.
        points: (n, 2) positions [m].
        triangles: (t, 3) corners.
        before: (n, 2) positions at the start [m], whose edge is drawn dashed.
        values: (t,) what the colours show, in units of the label, or None for one colour.
        label: what the values are.
        width: of its picture [pixel].
    """

    title: str
    points: Array
    triangles: Index
    before: Array
    values: Array | None = None
    label: str = ""
    width: int = 380


@path_came_first(1, 2, 0)
@typed
def deformed(  # noqa: PLR0913  keywords of one picture
    curves: dict[str, tuple[Any, Any]],
    shapes: Sequence[Shape],
    path: str | Path | None = None,
    *,
    limit: tuple[str, float],
    xlabel: str,
    ylabel: str,
    title: str,
    caption: str,
) -> Path | page.Picture:
    """Draw curves that tend to a limit beside the bodies they belong to.

    Args:
        curves: {name: (x (n,), y (n,))}, x on a logarithmic axis.
        shapes: bodies, from left to right.
        path: picture to write, .png; None to get the `Picture` itself.
        limit: name and value of a horizontal line, in units of y.
        xlabel: of the curves.
        ylabel: of the curves.
        title: heading.
        caption: what a stranger has to know.

    Raises:
        ConfigError: if the shapes do not fit beside the curves, or pictures cannot be made here.
    """
    path, left = page.wanted(path), PAGE_WIDTH - 30 - sum(s.width + 30 for s in shapes)
    if left < 400:
        raise ConfigError(f"{len(shapes)} shapes leave {left} pixels for the curves.")
    with page.styled():
        text, below = page.caption(caption, PAGE_WIDTH - 60)
        height = 135 + PANEL_HEIGHT + 110 + below
        figure = page.sheet(PAGE_WIDTH, height)
        page.words(figure, title, 30, 25, size=page.TITLE_SIZE, weight="bold")
        axes = page.area(figure, 110, 120, left - 140, PANEL_HEIGHT)
        for k, (name, (x, y)) in enumerate(curves.items()):
            look = {"color": LINES[k], "marker": MARKERS[k], "lw": 1.5}
            axes.semilogx(np.asarray(x), np.asarray(y), label=name, **look)
        axes.axhline(limit[1], color=EDGE_COLOUR, ls="--", lw=1.0, label=limit[0])
        ticks = np.unique(np.concatenate([np.asarray(x) for x, _ in curves.values()]))
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.minorticks_off()
        axes.set_xlabel(xlabel, size=page.BODY_SIZE)
        axes.set_ylabel(ylabel, size=page.BODY_SIZE)
        finish(axes, legend=True)
        for shape in shapes:
            page.words(figure, shape.title, left + 10, 80, size=page.BODY_SIZE)
            _shape(page.area(figure, left, 120, shape.width, PANEL_HEIGHT), shape)
            if shape.values is not None:
                bar = (left + 40, 120 + PANEL_HEIGHT + 32, shape.width - 80, 14)
                limits = (0.0, float(shape.values.max()))
                page.colour_bar(figure, limits, shape.label, bar)
            left += shape.width + 30
        page.words(figure, text, 30, height - below - 15, size=page.SMALL_SIZE)
        return page.save(figure, path)


@path_came_first(1, 2, 0)
@typed
def flow(
    times: Array,
    shapes: Sequence[Shape],
    path: str | Path,
    *,
    seconds: float = 4.0,
    caption: str,
) -> Path:
    """Film of one body; colours and frame stay the same from first to last.

    Args:
        times: (k,) of the shapes [s].
        shapes: (k) states of the body, with values.
        path: film to write, .gif.
        seconds: how long the film lasts [s].
        caption: what a stranger has to know.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    path = page.checked(path, ".gif")
    if len(times) != len(shapes):
        raise ConfigError(f"{len(times)} times for {len(shapes)} shapes.")
    highest = max(float(s.values.max()) for s in shapes if s.values is not None)
    everything = np.concatenate([s.points for s in shapes])
    frame = np.array([everything.min(axis=0), everything.max(axis=0)])
    width, height = FILM_SIZE
    pages = []
    with page.styled():
        text, below = page.caption(caption, width - 40)
        for t, shape in zip(times, shapes, strict=True):
            figure = page.sheet(width, height + 155 + below)
            page.words(figure, f"t = {1e6 * t:.1f} \u00b5s", 20, 12)
            axes = page.area(figure, 10, 45, width - 20, height)
            _shape(axes, shape, highest=highest, frame=frame)
            bar = (width / 2 - 200, height + 80, 400, 14)
            page.colour_bar(figure, (0.0, highest), shape.label, bar)
            page.words(figure, text, 20, height + 142, size=page.SMALL_SIZE)
            pages.append(page.pixels(figure))
    write_gif(path, np.stack(pages), seconds / len(pages))
    return path


def _shape(
    axes: Any, shape: Shape, *, highest: float | None = None, frame: Array | None = None
) -> None:
    x, y = shape.points.T
    if shape.values is None:
        axes.tripcolor(x, y, shape.triangles, facecolors=np.zeros(len(shape.triangles)),
                       cmap=_one_colour(), edgecolors=EDGE_COLOUR, lw=0.5)  # fmt: skip
    else:
        top = highest or float(shape.values.max())
        axes.tripcolor(x, y, shape.triangles, facecolors=shape.values, cmap=COLOUR_MAP, vmin=0.0,
                       vmax=top, edgecolors="face", lw=0.7)  # fmt: skip
    for edge in _boundary(shape.triangles):
        axes.plot(*shape.before[edge].T, color=UNDEFORMED_COLOUR, ls="--", lw=0.9)
    both = np.vstack([shape.points, shape.before]) if frame is None else frame
    low, high = both.min(axis=0), both.max(axis=0)
    margin = 0.04 * (high - low).max()
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _one_colour() -> Any:
    from matplotlib.colors import ListedColormap

    return ListedColormap([SURFACE_COLOUR])


def _boundary(triangles: Index) -> Index:
    """(m, 2) sides that belong to one triangle."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(sides, axis=0, return_counts=True)
    return edges[count == 1]
