"""Drawings in a plane: fields with their level curves, linkages, walls of blocks."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.arguments import typed
from rom.errors import ConfigError
from rom.model import Array
from rom.view.canvas import page
from rom.view.canvas.offscreen import COLOUR_MAP
from rom.view.figures.curves import LINES, MARKERS, fill, legend_names, line_look
from rom.view.figures.things import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE_WIDTH = 1400  # [pixel]
COLUMN_GAP = 120  # [pixel]
ROW_GAP, BARE_GAP = 150, 90  # below a drawing with a legend, and without [pixel]
BAR_WIDTH = 60  # of a colour bar [pixel]
BESIDE: page.Style = {"fraction": 0.05, "pad": 0.03}  # where it is, in shares of a drawing
MANY_CELLS, MANY_POINTS = 12, 40  # fewer values along a shade are squares; more points are small
LABEL_RATIO = 0.04  # of a drawing, that the names of level curves stay away from its edge
ON_SHADE = (("#d1495b", "white"), ("white", "#22262b"))  # fill and edge of points on colours
STONE_COLOUR, EDGE_COLOUR = "#d9d2c3", "#5c636e"


@typed
@dataclass
class Drawing:
    """One drawing, from back to front.

    Attributes:
        title: what it shows.
        x, y: labels of the axes with their units.
        extent: (left, right, bottom, top) of the drawing, in units of the axes; None for what it
            holds.
        shade: (n, m) values in units of the label over the extent, first index along x; or None.
        label: what the colours of the shade or the polygons mean.
        limits: (2,) values at the ends of these colours, in units of the label; None for the
            smallest and the largest.
        polygons: (k, 2) outlines in units of the axes, filled.
        values: (number of polygons,) for their colours, in units of the label; None for stone.
        curves: {label: list of (k, 2) curves in units of the axes}; labels that start with "_" stay
            out of the legend.
        points: {label: (k, 2) points in units of the axes}.
        levels: {value: list of (k, 2) level curves of the shade}, thin and named by their value.
        equal: the same scale along x and y.
    """

    title: str
    x: str
    y: str
    extent: tuple[float, float, float, float] | None = None
    shade: Array | None = None
    label: str = ""
    limits: tuple[float, float] | None = None
    polygons: Sequence[Array] = ()
    values: Array | None = None
    curves: dict[str, list[Array]] = field(default_factory=dict)
    points: dict[str, Array] = field(default_factory=dict)
    levels: dict[float, list[Array]] = field(default_factory=dict)
    equal: bool = True


@typed
@page.picture
def plane(
    drawings: Sequence[Drawing | Scene],
    path: str | Path | None = None,
    *,
    title: str = "",
    caption: str = "",
    columns: int = 2,
    height: int = 480,
    ax: object = None,
) -> "Figure":
    """Draw things in a plane, side by side.

    Those without an extent of their own have one scale if their axes have the same names.

    Args:
        drawings: drawings and scenes row by row, from the top left.
        path: picture to write, .png; None to write nothing.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        columns: drawings in a row.
        height: of each drawing [pixel].
        ax: Axes of matplotlib to draw into, one for each drawing; None for a page of its own.

    Raises:
        ConfigError: without a drawing, or if pictures cannot be made here.
    """
    if not drawings:
        raise ConfigError("there is nothing to draw; give at least one drawing.")
    rows = -(-len(drawings) // columns)
    gap = ROW_GAP if any(isinstance(x, Drawing) and legend_names(x) for x in drawings) else BARE_GAP
    width = (PAGE_WIDTH - 30) // columns - COLUMN_GAP
    places = list[page.Place]()
    for k, drawing in enumerate(drawings):
        row, column = divmod(k, columns)
        left, top = 95 + column * (width + COLUMN_GAP), 110 + row * (height + gap)
        narrow = BAR_WIDTH if isinstance(drawing, Drawing) and drawing.label else 0
        places.append((left, top, width - narrow, height))
    size = PAGE_WIDTH, 100 + rows * (height + gap)
    figure, areas = page.areas(ax, places, "plane", size, title, caption)
    fill(figure, areas, drawings, _draw, legend=False)
    return figure


def _draw(axes: "Axes", drawing: Drawing, numbers: dict[str, int]) -> None:
    axes.set_title(drawing.title, size=page.BODY_SIZE, loc="left")
    axes.set(xlabel=drawing.x, ylabel=drawing.y)
    over = drawing.shade is not None
    if drawing.shade is not None:
        how: page.Style = {"origin": "lower", "extent": drawing.extent, "cmap": COLOUR_MAP}
        smooth = min(drawing.shade.shape) > MANY_CELLS
        how |= {"interpolation": "bilinear" if smooth else "nearest"}
        how |= {"aspect": "equal" if drawing.equal else "auto"}
        image = axes.imshow(drawing.shade.T, **how)
        image.set_clim(drawing.limits)
        page.scale_beside(axes, image, drawing.label, **BESIDE)
    _fill(axes, drawing)
    for k, (label, curves) in enumerate(drawing.curves.items()):
        for n, curve in enumerate(curves):
            look = line_look(numbers.get(label, k))
            look |= {"lw": 2.0, "zorder": look["zorder"] + 1.0}
            look |= {"color": "white", "lw": 1.0} if over else {}
            axes.plot(*curve.T, label=label if n == 0 else f"_{label}", **look)
    _draw_levels(axes, drawing)
    for k, (label, points) in enumerate(drawing.points.items()):
        fill, edge = ON_SHADE[k % 2] if over else (LINES[(k + 1) % len(LINES)], "white")
        look = {"color": fill, "edgecolor": edge, "zorder": 4}
        look |= {"s": 48 if len(points) < MANY_POINTS else 14}
        axes.scatter(*points.T, marker=MARKERS[k % len(MARKERS)], label=label, **look)
    if drawing.extent is not None:
        axes.set(xlim=drawing.extent[:2], ylim=drawing.extent[2:])
    if axes.get_legend_handles_labels()[0]:
        place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.15), "borderaxespad": 0.0}
        axes.legend(fontsize=page.SMALL_SIZE, frameon=False, ncol=3, **place)


def _draw_levels(axes: "Axes", drawing: Drawing) -> None:
    """Level curves, each value written once on them, far from the other values and the points."""
    if not drawing.levels or drawing.extent is None:
        return
    low, high = np.reshape(drawing.extent, (2, 2)).T
    taken = [(xy - low) / (high - low) for xy in drawing.points.values()]
    for value, curves in drawing.levels.items():
        for curve in curves:
            axes.plot(*curve.T, color="white", lw=1.0, zorder=3)
        places = (np.vstack(curves) - low) / (high - low)
        places = places[(abs(places - 0.5) < 0.5 - LABEL_RATIO).all(axis=1)]
        if not len(places):
            continue
        apart = [np.linalg.norm(places[:, None] - others, axis=2).min(axis=1) for others in taken]
        best = places[np.argmax(np.min([*apart, np.ones(len(places))], axis=0))]
        taken.append(best[None])
        box = {"fc": "#22262b", "ec": "none", "alpha": 0.65, "pad": 1.2}
        look: page.Style = {"ha": "center", "va": "center", "color": "white", "zorder": 5}
        x, y = low + best * (high - low)
        axes.text(x, y, f"{value:g}", size=page.SMALL_SIZE, bbox=box, **look)


def _fill(axes: "Axes", drawing: Drawing) -> None:
    if not len(drawing.polygons):
        return
    from matplotlib.collections import PolyCollection

    look: page.Style = {"edgecolor": EDGE_COLOUR, "linewidth": 0.8}
    if drawing.values is None:
        look["facecolor"] = STONE_COLOUR
    else:
        look |= {"array": np.asarray(drawing.values, dtype=float), "cmap": COLOUR_MAP}
    blocks = PolyCollection(drawing.polygons, **look)
    axes.add_collection(blocks)
    if drawing.values is not None:
        blocks.set_clim(drawing.limits)
        page.scale_beside(axes, blocks, drawing.label, **BESIDE)
    axes.autoscale_view()
