"""Sheets of paper: pictures, words and colour bars, laid out in pixels from the top left."""

import inspect
import textwrap
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np

from rom.arguments import shortened
from rom.errors import ConfigError
from rom.view.canvas.offscreen import COLOUR_MAP, Image, checked, require
from rom.view.canvas.offscreen import styled as styled
from rom.view.canvas.scene import TEXT_COLOUR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage
    from matplotlib.text import Text

    from rom.view.canvas.picture import Picture

Given = ParamSpec("Given")
Place = tuple[float, float, float, float]  # of axes: left end, top, width, height [pixel]
Style = dict[str, Any]  # how matplotlib draws something, by its keywords
DPI = 150
TITLE_SIZE, BODY_SIZE, SMALL_SIZE = 12.5, 9.5, 8.5  # points
LINE_HEIGHT = 26  # of small text [pixel]
LETTER_WIDTH = 0.545 * SMALL_SIZE * DPI / 72  # of small text, on the average [pixel]
TICK_WIDTH = 45  # of a tick below a colour bar, with its number [pixel]
HANDLE_WIDTH, ROW_HEIGHT = 80, 27  # of a legend: beside its names, and of a row [pixel]


def sheet(width: int, height: int) -> "Picture":
    """A white sheet of that many pixels."""
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from rom.view.canvas.picture import Picture

    figure = Picture(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def picture(draw: "Callable[Given, Figure]") -> "Callable[Given, Figure]":
    """A function that draws a figure: in the look of the house, then written to its ``path``."""
    order = inspect.signature(draw)

    @wraps(draw)
    def drawn(*args: Given.args, **named: Given.kwargs) -> "Figure":
        path = order.bind(*args, **named).arguments.get("path")
        place = None if path is None else checked(path, ".png")
        with styled():
            return save(draw(*args, **named), place)

    return drawn


def area(figure: "Figure", left: float, top: float, width: float, height: float) -> "Axes":
    """Axes in a rectangle given in pixels from the top left corner."""
    w, h = figure.get_size_inches() * DPI
    return figure.add_axes((left / w, 1 - (top + height) / h, width / w, height / h))


def place(figure: "Figure", image: Image, left: float, top: float) -> "AxesImage":
    """Put a picture on the sheet, pixel for pixel."""
    height, width = image.shape[:2]
    axes = area(figure, left, top, width, height)
    axes.set_axis_off()
    return axes.imshow(image, aspect="auto", interpolation="nearest")


def words(figure: "Figure", text: str, left: float, top: float, **options: Any) -> "Text":
    """Write text whose upper left corner is at a pixel."""
    w, h = figure.get_size_inches() * DPI
    look: Style = {"size": BODY_SIZE, "va": "top", "color": TEXT_COLOUR} | options
    return figure.text(left / w, 1 - top / h, text, **look)


def caption(text: str, width: int) -> tuple[str, int]:
    """The text broken into lines that fit into so many pixels, and its height."""
    lines = textwrap.wrap(text, int(width / LETTER_WIDTH))
    return "\n".join(lines), LINE_HEIGHT * len(lines)


def titled(width: int, height: int, title: str, below: str) -> "Picture":
    """A sheet with its heading, and a caption below so many pixels of room for pictures."""
    text, more = caption(below, width - 60)
    figure = sheet(width, height + more + 20)
    words(figure, title, 30, 25, size=TITLE_SIZE, weight="bold")
    words(figure, text, 30, height, size=SMALL_SIZE)
    return figure


def strips(texts: Sequence[str], width: int, height: int) -> Image:
    """(n, height, width, 3) strips with a text each, such as the time above pictures of a film."""
    made = [sheet(width, height) for _ in texts]
    for strip, text in zip(made, texts, strict=True):
        words(strip, text, 20, 8)
    return np.stack([pixels(strip) for strip in made])


def packed(names: Sequence[str], width: float) -> list[tuple[int, float]]:
    """Row and left end [pixel] of small names with a square each, in rows of that width."""
    places, row, left = [], 0, 15.0
    for name in names:
        wide = 56 + LETTER_WIDTH * len(name)
        if left > 15.0 and left + wide > width:
            row, left = row + 1, 15.0
        places.append((row, left))
        left += wide
    return places


def legend_shape(names: Sequence[str], width: float) -> tuple[int, int]:
    """Rows and columns of a legend that fits into so many pixels."""
    if not names:
        return 0, 1
    wide = HANDLE_WIDTH + LETTER_WIDTH * max(map(len, names))
    columns = min(len(names), max(1, int(width / wide)))
    rows = -(-len(names) // columns)
    return rows, -(-len(names) // rows)


def legend_above(axes: "Axes", width: float, height: int = 0) -> None:
    """Names of curves between axes so wide [pixel] and their title, at least so high above them."""
    handles, names = axes.get_legend_handles_labels()
    rows, columns = legend_shape(names, width)
    if rows:
        look: Style = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "frameon": False}
        look |= {"borderpad": 0.2, "borderaxespad": 0.1, "handlelength": 2.0, "handletextpad": 0.6}
        look |= {"columnspacing": 1.3, "labelspacing": 0.35, "fontsize": SMALL_SIZE}
        axes.legend(handles, names, ncol=columns, **look)
    if title := axes.get_title(loc="left"):
        pad = 8 + max(height, rows * ROW_HEIGHT) * 72 / DPI
        axes.set_title(title, loc="left", size=BODY_SIZE, pad=pad)


def colour_bar(figure: "Figure", limits: tuple[float, float], label: str, bar: Place) -> None:
    """Horizontal colour bar with its scale below."""
    axes = area(figure, *bar)
    shade = np.linspace(0, 1, 512)[None]
    axes.imshow(shade, aspect="auto", cmap=COLOUR_MAP, extent=(*limits, 0.0, 1.0))
    axes.set_yticks([])
    axes.tick_params(labelsize=SMALL_SIZE, pad=3, length=4)
    axes.locator_params(axis="x", nbins=int(np.clip(bar[2] // TICK_WIDTH, 1, 6)))
    axes.set_title(label, size=SMALL_SIZE, pad=6)


def scale_beside(axes: "Axes", coloured: Any, label: str, **where: Any) -> None:
    """The colour bar of what is drawn in axes, which takes some of their room."""
    bar = axes.figure.colorbar(coloured, ax=axes, **where)
    bar.set_label(label, size=SMALL_SIZE)
    bar.ax.tick_params(labelsize=SMALL_SIZE)


def pixels(figure: "Figure") -> Image:
    """(height, width, 3) the finished sheet."""
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()  # type: ignore[attr-defined]


def areas(
    ax: object, places: Sequence[Place], name: str, size: tuple[int, int], title: str, below: str
) -> tuple["Figure", list["Axes"]]:
    """Axes of the caller of a function, or at places on a page, see `titled`; and their figure."""
    from matplotlib.axes import Axes

    if ax is None:
        page = titled(*size, title, below)
        return page, [area(page, *place) for place in places]
    n = len(places)
    given = [ax] if isinstance(ax, Axes) else list(np.ravel(np.asarray(ax, dtype=object)))
    if len(given) != n or not all(isinstance(axes, Axes) for axes in given):
        raise ConfigError(
            f"{name}: ax = {shortened(ax)} must be {n} Axes of matplotlib, one for each diagram.",
            hint=f"figure, ax = matplotlib.pyplot.subplots({n})",
        )
    return given[0].figure.figure, given


def save(figure: "Figure", path: Path | None) -> "Figure":
    """The figure, written as PNG where there is a path."""
    from rom.view.canvas.picture import Picture, written

    if path is not None and isinstance(figure, Picture):
        figure.save(path)
    elif path is not None:
        written(figure, path)
    return figure
