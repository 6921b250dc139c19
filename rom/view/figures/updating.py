"""Frequency responses before and after an update, with what was changed and where it was seen."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.deprecated import path_came_first
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.offscreen import render
from rom.view.canvas.scene import Actor, aimed
from rom.view.figures.curves import LINES, finish

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH, TOP_HEIGHT, BOTTOM_HEIGHT = 1500, 430, 430  # pixel
DOT_COLOUR, LINE_COLOUR = "#8b929c", "#6b7480"


@path_came_first(1, 2, 3, 0)
@typed
def updating(  # noqa: PLR0913  keywords of one picture
    f: npt.ArrayLike,
    curves: dict[str, npt.ArrayLike | npt.NDArray[np.complex128]],
    changes: dict[str, tuple[float, float, float]],
    path: str | Path | None = None,
    *,
    structure: tuple[Array, Index, Array, Array],
    label: str,
    title: str = "",
    caption: str = "",
    ax: Any = None,
) -> "Figure":
    """Draw one response of test and model above the changes that explain it.

    Args:
        f: (n,) frequencies [Hz].
        curves: {name: (n,) complex receptance [m/N]}: test, model before, model after.
        changes: {parameter: (true, found, standard deviation)} as fractions [1].
        path: picture to write, .png; None to write nothing.
        structure: points (n, 3) [m], beams (m, 2), sensor and exciter positions (k, 3), (l, 3).
        label: what the response is, with its unit.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        ax: three Axes of matplotlib, for responses, changes and structure; None for a page of its
            own.

    Returns:
        The figure; that of ``ax`` where it is given.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    path, f = page.wanted(path), np.asarray(f, dtype=float)
    for name, values in curves.items():
        if np.shape(values) != f.shape:
            raise ConfigError(f"{name!r} has {np.size(values)} values for {f.size} frequencies.")
    image = _structure(*structure)
    if ax is not None:
        figure, (responses, bars, seen) = page.taken(ax, 3, "updating")
        _responses(responses, f, curves, label)
        _changes(bars, changes)
        seen.imshow(image)
        seen.set_axis_off()
        return page.save(figure, path)
    with page.styled():
        text, below = page.caption(caption, PAGE_WIDTH - 60)
        height = 85 + TOP_HEIGHT + 110 + BOTTOM_HEIGHT + 95 + below
        figure = page.sheet(PAGE_WIDTH, height)
        page.words(figure, title, 30, 25, size=page.TITLE_SIZE, weight="bold")
        _responses(page.area(figure, 130, 85, PAGE_WIDTH - 170, TOP_HEIGHT), f, curves, label)
        top = 85 + TOP_HEIGHT + 110
        _changes(page.area(figure, 250, top, 540, BOTTOM_HEIGHT), changes)
        page.place(figure, image, 840, top + (BOTTOM_HEIGHT - image.shape[0]) // 2 - 20)
        for k, (mark, what) in enumerate(((LINES[0], "sensors"), (LINES[1], "exciters"))):
            page.words(figure, "\u25cf", 1000 + 170 * k, top + BOTTOM_HEIGHT - 10, color=mark)
            page.words(figure, what, 1025 + 170 * k, top + BOTTOM_HEIGHT - 10, size=page.SMALL_SIZE)
        page.words(figure, text, 30, height - below - 15, size=page.SMALL_SIZE)
        return page.save(figure, path)


def _responses(
    axes: Any, f: Array, curves: dict[str, npt.ArrayLike | npt.NDArray[np.complex128]], label: str
) -> None:
    looks: tuple[dict[str, Any], ...] = (
        {"ls": "", "marker": ".", "ms": 5, "color": DOT_COLOUR},
        {"ls": "--", "lw": 1.3, "color": LINES[2]},
        {"lw": 1.6, "color": LINES[0]},
    )
    for (name, values), look in zip(curves.items(), looks, strict=False):
        axes.semilogy(f, np.abs(np.asarray(values)), label=name, **look)
    axes.set_xlim(f[0], f[-1])
    axes.set_xlabel("frequency [Hz]", size=page.BODY_SIZE)
    axes.set_ylabel(label, size=page.BODY_SIZE)
    finish(axes, legend=True)


def _changes(axes: Any, changes: dict[str, tuple[float, float, float]]) -> None:
    true, found, spread = (100 * np.array(part) for part in zip(*changes.values(), strict=True))
    place = np.arange(len(changes))[::-1]
    axes.barh(place, true, height=0.72, color="#d5dae1", label="true")
    axes.errorbar(found, place, xerr=2 * spread, fmt="o", ms=5, color=LINES[0], capsize=3,
                  label="found, ± two standard deviations")  # fmt: skip
    axes.plot([0, 0], [-0.6, len(changes) - 0.4], color=LINE_COLOUR, lw=0.8)
    axes.set_yticks(place, list(changes))
    axes.set_ylim(-0.6, len(changes) + 0.3)
    axes.set_xlabel("change of the model [%]", size=page.BODY_SIZE)
    finish(axes, legend=False)
    axes.legend(fontsize=page.SMALL_SIZE, loc="upper center", ncol=2, frameon=False, borderpad=0.1)


def _structure(points: Array, beams: Index, sensors: Array, exciters: Array) -> Any:
    actors = [Actor(points[None], beams, colour=LINE_COLOUR, width=4.0)]
    for where, colour, size in ((sensors, LINES[0], 11.0), (exciters, LINES[1], 15.0)):
        where = np.asarray(where, dtype=float)
        actors.append(Actor(where[None], np.arange(len(where))[:, None], colour=colour, width=size))
    camera = aimed(points, 620, view=(1.0, 0.9, 0.8), up=(0, 0, 1), heights=(0.3, 0.62))
    return render(actors, camera)[0]
