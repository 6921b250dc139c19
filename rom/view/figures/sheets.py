"""Plane bodies of triangles: figures and films of how they deform."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.arguments import one_each, typed
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.films import Film, finished, wanted
from rom.view.canvas.offscreen import COLOUR_MAP
from rom.view.canvas.scales import clock_texts
from rom.view.canvas.scene import boundary
from rom.view.figures.curves import LINES, MARKERS, finish

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.figure import Figure

PAGE_WIDTH, PANEL_HEIGHT, BAR_HEIGHT = 1500, 430, 25  # pixel; the bar is one of colours
FILM_SIZE = (640, 700)  # of the picture in a film [pixel]
TOOL_COLOUR = "#c9cfd6"
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
        tools: outlines (k, 2) of rigid bodies beside it [m].
    """

    title: str
    points: Array
    triangles: Index
    before: Array
    values: Array | None = None
    label: str = ""
    width: int = 380
    tools: tuple[Array, ...] = ()


@typed
@page.picture
def deformed(  # noqa: PLR0913  keywords of one picture
    curves: Mapping[str, tuple[object, object]],
    shapes: Sequence[Shape],
    path: str | Path | None = None,
    *,
    limit: tuple[str, float],
    xlabel: str,
    ylabel: str,
    title: str = "",
    heading: str = "",
    caption: str = "",
    ax: object = None,
) -> "Figure":
    """Draw curves that tend to a limit beside the bodies they belong to.

    Args:
        curves: {name: (x (n,), y (n,))}, x on a logarithmic axis.
        shapes: bodies, from left to right.
        path: picture to write, .png; None to write nothing.
        limit: name and value of a horizontal line, in units of y.
        xlabel: of the curves.
        ylabel: of the curves.
        title: heading of the page.
        heading: of the diagram of the curves.
        caption: what a stranger has to know; not written into axes of yours.
        ax: Axes of matplotlib, for the curves and each shape; None for a page of its own.

    Raises:
        ConfigError: if the shapes do not fit beside the curves, or pictures cannot be made here.
    """
    from matplotlib.ticker import MaxNLocator

    left = PAGE_WIDTH - 10 - sum(s.width + 50 for s in shapes)
    if left < 400 and ax is None:
        raise ConfigError(f"{len(shapes)} shapes leave {left} pixels for the curves; take fewer.")
    places = [(110, 120, left - 140, PANEL_HEIGHT)]
    for shape in shapes:
        below = 0 if shape.values is None else BAR_HEIGHT
        places.append((left, 120, shape.width, PANEL_HEIGHT + below))
        left += shape.width + 50
    size = PAGE_WIDTH, 225 + PANEL_HEIGHT
    figure, (axes, *areas) = page.areas(ax, places, "deformed", size, title, caption)
    axes.set_title(heading, size=page.BODY_SIZE, loc="left")
    for area, shape in zip(areas, shapes, strict=True):
        area.set_title(shape.title, size=page.BODY_SIZE, loc="left")
        drawn = _shape(area, shape)
        if shape.values is not None:
            where = {"location": "bottom", "fraction": 0.03, "pad": 0.02, "aspect": 24}
            page.scale_beside(area, drawn, shape.label, ticks=MaxNLocator(4), **where)
    for k, (name, (x, y)) in enumerate(curves.items()):
        look = {"color": LINES[k], "marker": MARKERS[k], "lw": 1.5}
        axes.semilogx(np.asarray(x), np.asarray(y), label=name, **look)
    axes.axhline(limit[1], color=EDGE_COLOUR, ls="--", lw=1.0, label=limit[0])
    ticks = np.unique(np.concatenate([np.asarray(x) for x, _ in curves.values()]))
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.set(xlabel=xlabel, ylabel=ylabel)
    finish(axes, legend=True)
    return figure


@typed
def flow(
    times: Array,
    shapes: Sequence[Shape],
    path: str | Path | None = None,
    *,
    seconds: float = 4.0,
    caption: str = "",
) -> Film:
    """Film of one body; colours and frame stay the same from first to last.

    Args:
        times: (k,) of the shapes [s].
        shapes: (k) states of the body, with values.
        path: film to write, .gif or .mp4; None to write nothing.
        seconds: how long the film lasts [s].
        caption: what a stranger has to know.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    path = wanted(path)
    one_each("times", len(times), "shapes", len(shapes))
    highest = max(float(s.values.max()) for s in shapes if s.values is not None)
    everything = np.concatenate([s.points for s in shapes])
    frame = np.array([everything.min(axis=0), everything.max(axis=0)])
    width, height = FILM_SIZE
    pages = []
    with page.styled():
        text, below = page.caption(caption, width - 40)
        for clock, shape in zip(clock_texts(times), shapes, strict=True):
            figure = page.sheet(width, height + 155 + below)
            page.words(figure, clock, 20, 12)
            page.words(figure, shape.title, width - 20, 12, ha="right")
            axes = page.area(figure, 10, 45, width - 20, height)
            _shape(axes, shape, highest=highest, frame=frame)
            bar = (width / 2 - 200, height + 80, 400, 14)
            page.colour_bar(figure, (0.0, highest), shape.label, bar)
            page.words(figure, text, 20, height + 142, size=page.SMALL_SIZE)
            pages.append(page.pixels(figure))
    return finished(np.stack(pages), seconds / len(pages), path)


def _shape(
    axes: "Axes", shape: Shape, *, highest: float | None = None, frame: Array | None = None
) -> "Collection":
    """Draw a body, and give back what has its colours."""
    x, y = shape.points.T
    look: page.Style = {"facecolors": shape.values, "cmap": COLOUR_MAP, "vmin": 0.0}
    look |= {"edgecolors": "face", "lw": 0.7}
    if shape.values is None:
        from matplotlib.colors import ListedColormap

        plain, one = np.zeros(len(shape.triangles)), ListedColormap([SURFACE_COLOUR])
        look = {"facecolors": plain, "cmap": one, "edgecolors": EDGE_COLOUR, "lw": 0.5}
    else:
        look["vmax"] = highest or float(shape.values.max())
    drawn = axes.tripcolor(x, y, shape.triangles, **look)
    for edge in boundary(shape.triangles):
        axes.plot(*shape.before[edge].T, color=UNDEFORMED_COLOUR, ls="--", lw=0.9)
    for outline in shape.tools:
        axes.fill(*outline.T, facecolor=TOOL_COLOUR, edgecolor=EDGE_COLOUR, hatch="///", lw=0.8)
    both = np.vstack([shape.points, shape.before]) if frame is None else frame
    low, high = both.min(axis=0), both.max(axis=0)
    margin = 0.04 * (high - low).max()
    across, upwards = np.transpose([low - margin, high + margin])
    axes.set(xlim=across, ylim=upwards, aspect="equal")
    axes.set_axis_off()
    return drawn
