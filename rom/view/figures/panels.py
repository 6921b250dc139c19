"""Several small diagrams on one sheet: paths, curves, points and bars."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.arguments import one_each, typed
from rom.model import Array
from rom.view.canvas import page
from rom.view.canvas.scales import without_round_off
from rom.view.canvas.scene import TEXT_COLOUR
from rom.view.figures.curves import (
    LINES,
    MARKERS,
    PAGE_WIDTH,
    fill,
    legend_names,
    line_look,
    near_ticks,
)
from rom.view.figures.things import Scene, below_height, seen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# pixel, of a diagram and around it
PANEL_HEIGHT, LEFT_MARGIN, RIGHT_MARGIN, TOP_MARGIN, BOTTOM_MARGIN = 370, 95, 30, 55, 75
SCENE_MORE = 90  # by which rows with scenes are higher [pixel]
LEAST_WIDTH = 420  # of scenes beside diagrams [pixel]
GUIDE_STYLE: page.Style = {"color": "#8a9199", "lw": 0.9}  # a curve without a name
Line = tuple[Any, Any]  # (n,) numbers each; NaN leaves a gap


@typed
@dataclass(frozen=True)
class Panel:
    """One diagram.

    Attributes:
        title: what it shows.
        xlabel, ylabel: labels of the axes with their units; a sketch has none, and no axes.
        curves: {name: (x (n,), y (n,))} as lines; thin, without legend, if it begins with "_".
        points: {name: (x (n,), y (n,))} drawn as small marks over them, each name with its own.
        bars: {name: (low, high)} horizontal bars in units of the axis, from top to bottom.
        ends: what the two ends of the bars are; each then has a colour of its own from zero on.
        notes: {words: (x, y)} written beside that place.
        equal: the same scale along both axes.
        log: logarithmic scales along both axes.

    Example:
        >>> line = rom.view.Panel("A line", "x [m]", "y [m]", curves={"y = 2 x": ([0, 1], [0, 2])})
        >>> line.curves["y = 2 x"][1]
        [0, 2]
    """

    title: str
    xlabel: str
    ylabel: str = ""
    curves: Mapping[str, Line] = field(default_factory=dict)
    points: Mapping[str, Line] = field(default_factory=dict)
    bars: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    ends: tuple[str, str] | None = None
    notes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    equal: bool = False
    log: bool = False


@typed
@page.picture
def panels(
    rows: Sequence[Sequence[Panel | Scene]],
    path: str | Path | None = None,
    *,
    title: str = "",
    caption: str = "",
    ax: object = None,
) -> "Figure":
    """Draw rows of diagrams; those whose axes have the same names have one scale.

    Args:
        rows: diagrams and scenes from top to bottom, and from left to right in each row.
        path: picture to write, .png; None to write nothing.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        ax: Axes of matplotlib, one for each diagram, row by row; None for a page of its own.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    diagrams = [panel for row in rows for panel in row]
    legends = [_legend_height(row) for row in rows]
    heights = [_height(row) if ax is None else 0 for row in rows]
    feet = 65 + np.cumsum(np.add(legends, heights) + TOP_MARGIN + BOTTOM_MARGIN)
    places, above = list[page.Place](), []
    for row, legend, height, foot in zip(rows, legends, heights, feet, strict=True):
        top = foot - BOTTOM_MARGIN - height
        for panel, (left, width) in zip(row, _columns(row), strict=True):
            more = (legend, BOTTOM_MARGIN) if isinstance(panel, Scene) else (0, 0)
            places.append((left, top - more[0], width, height + sum(more)))
            above.append((width, legend))
    size = PAGE_WIDTH, int(feet[-1]) + 5
    figure, areas = page.areas(ax, places, "panels", size, title, caption)
    fill(figure, areas, diagrams, _draw, legend=ax is not None)
    for axes, panel, (width, legend) in zip(areas, diagrams, above, strict=True):
        if isinstance(panel, Panel) and ax is None:
            page.legend_above(axes, width, legend)
    return figure


def _columns(row: Sequence[Panel | Scene]) -> list[tuple[float, float]]:
    """Left end and width of each diagram [pixel]; a scene beside others is as wide as it fills."""
    whole = PAGE_WIDTH - 2 * RIGHT_MARGIN
    widths = [min(_filled(x), whole / len(row)) if isinstance(x, Scene) else 0.0 for x in row]
    others = widths.count(0.0)
    columns, end = [], float(RIGHT_MARGIN)
    for panel, own in zip(row, widths, strict=True):
        left, bars = end, getattr(panel, "bars", ())
        if isinstance(panel, Panel):
            left += page.LETTER_WIDTH * max(map(len, bars)) + 25 if bars else LEFT_MARGIN
        end += whole / len(row) if not others else own or (whole - sum(widths)) / others
        columns.append((left, end - RIGHT_MARGIN - left))
    return columns


def _height(row: Sequence[Panel | Scene]) -> int:
    """Of the diagrams of a row; of scenes alone, what they fill [pixel]."""
    scenes, width = [x for x in row if isinstance(x, Scene)], int(_columns(row)[0][1])
    highest = PANEL_HEIGHT + SCENE_MORE * bool(scenes)
    if len(scenes) < len(row):
        return highest
    views = [seen(x, width, (0.0, 9.0), frames=slice(1), among=scenes) for x in scenes]
    filled = [view.camera.size[1] + below_height(view.scene, width) for view in views]
    return min(highest, max(filled) - BOTTOM_MARGIN)


def _filled(scene: Scene) -> float:
    """Width of a column that a scene fills as high as its row is [pixel]."""
    tall = PANEL_HEIGHT + SCENE_MORE + BOTTOM_MARGIN - below_height(scene, LEAST_WIDTH)
    width, height = seen(scene, PAGE_WIDTH, (0.0, 9.0), frames=slice(1)).camera.size
    return max(LEAST_WIDTH, tall * width / height + RIGHT_MARGIN)


def _legend_height(row: Sequence[Panel | Scene]) -> int:
    rows = [
        page.legend_shape(legend_names(panel), width)[0] if isinstance(panel, Panel) else 0
        for panel, (_, width) in zip(row, _columns(row), strict=True)
    ]
    return page.ROW_HEIGHT * max(rows, default=0)


def _draw(axes: "Axes", panel: Panel, numbers: Mapping[str, int]) -> None:
    curves, points = _lines(panel)
    for name, line in curves.items():
        guide = name not in numbers and (len(curves) > 1 or bool(points))
        axes.plot(*line, label=name, **(GUIDE_STYLE if guide else line_look(numbers.get(name, 0))))
    for name, line in points.items():
        named = [other for other in points if not other.startswith("_")]
        mark = MARKERS[named.index(name)] if name in named else "o"
        ring: page.Style = {"mec": "#22262b", "mfc": "none", "ms": 4.0, "mew": 0.8}
        axes.plot(*line, mark, label=name, **ring)
    if panel.bars:
        _draw_bars(axes, panel)
    for words, place in panel.notes.items():
        look: page.Style = {"size": page.SMALL_SIZE, "color": TEXT_COLOUR, "va": "center"}
        look["bbox"] = {"fc": "white", "ec": "none", "alpha": 0.8, "pad": 0.8}
        axes.annotate(words, place, (6, 0), textcoords="offset points", **look)
    axes.set_title(panel.title, size=page.BODY_SIZE, loc="left")
    axes.set(xlabel=panel.xlabel, ylabel=panel.ylabel)
    if panel.log:
        axes.loglog()
        near_ticks(axes.xaxis)
        near_ticks(axes.yaxis)
    if not (panel.xlabel or panel.ylabel):
        axes.set_axis_off()


def _lines(panel: Panel) -> tuple[dict[str, Line], dict[str, Line]]:
    """Curves and points; along linear axes without round-off."""
    lines: list[Line] = []
    for name, line in (*panel.curves.items(), *panel.points.items()):
        x, y = (np.atleast_1d(np.asarray(values, dtype=float)) for values in line)
        one_each(f"values of {name!r}", y.shape, "places", x.shape)
        lines.append((x, y))
    if not panel.log and lines:
        flat = (without_round_off(list(values)) for values in zip(*lines, strict=True))
        lines = list(zip(*flat, strict=True))
    n = len(panel.curves)
    curves = dict(zip(panel.curves, lines[:n], strict=True))
    return curves, dict(zip(panel.points, lines[n:], strict=True))


def _draw_bars(axes: "Axes", panel: Panel) -> None:
    bars = panel.bars
    low, high = np.array(list(bars.values()), dtype=float).T
    parts: list[tuple[Array, Array, str | None]] = [(low, high - low, None)]
    if panel.ends is not None:
        parts = [(0 * low, x, end) for x, end in zip((low, high), panel.ends, strict=True)]
    for k, (left, width, name) in enumerate(parts):
        axes.barh(np.arange(len(bars)), width, left=left, height=0.6, color=LINES[k], label=name)
    axes.axvline(0.0, color="#22262b", lw=0.8)
    axes.set_yticks(np.arange(len(bars)), list(bars))
    axes.use_sticky_edges = False
    axes.margins(x=0.06)
    axes.invert_yaxis()
