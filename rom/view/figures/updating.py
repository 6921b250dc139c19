"""Frequency responses before and after an update, with what was changed and where it was seen."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import one_each, typed
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.figures.curves import LINES, finish
from rom.view.figures.things import Scene, Thing, draw_scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH, TOP_HEIGHT, BOTTOM_HEIGHT = 1500, 430, 430  # pixel
DOT_COLOUR, LINE_COLOUR = "#8b929c", "#6b7480"


@typed
def updating(  # noqa: PLR0913  keywords of one picture
    f: npt.ArrayLike,
    curves: dict[str, Any],
    changes: dict[str, tuple[float, float, float]],
    path: str | Path | None = None,
    *,
    structure: tuple[Array, Index, Array, Array] | Scene,
    label: str,
    title: str = "",
    caption: str = "",
    ax: Any = None,
) -> "Figure":
    """Draw one response of test and model above the changes that explain it.

    Args:
        f: (n,) frequencies [Hz].
        curves: {name: (n,) complex receptance [m/N]}: test, model before, model after; or (k,)
            frequencies of their own [Hz] and (k,) receptances.
        changes: {parameter: (true, found, standard deviation)} as fractions [1].
        path: picture to write, .png; None to write nothing.
        structure: what is tested, with sensors and exciters; or points (n, 3) [m], beams (m, 2),
            and positions (k, 3), (l, 3) of the two.
        label: what the response is, with its unit.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        ax: four Axes of matplotlib, for responses, changes, their errors and structure; None for a
            page of its own.

    Returns:
        The figure; that of ``ax`` where it is given.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    path, f = page.wanted(path), np.asarray(f, dtype=float)
    lines = {
        name: values if isinstance(values, tuple) else (f, values)
        for name, values in curves.items()
    }
    for name, (own, values) in lines.items():
        one_each(f"values of {name!r}", np.shape(values), "frequencies", np.shape(own))
    scene = structure if isinstance(structure, Scene) else _frame(*structure)
    figure: Figure
    with page.styled():
        if ax is None:
            top = 85 + TOP_HEIGHT + 145
            figure = page.titled(PAGE_WIDTH, top + BOTTOM_HEIGHT + 75, title, caption)
            areas = [page.area(figure, 130, 85, PAGE_WIDTH - 170, TOP_HEIGHT)]
            areas += [page.area(figure, left, top, 270, BOTTOM_HEIGHT) for left in (250, 560)]
            areas += [page.area(figure, 880, top - 10, 590, BOTTOM_HEIGHT + 85)]
        else:
            figure, areas = page.taken(ax, 4, "updating")
        _responses(areas[0], f, lines, label)
        _changes(areas[1], areas[2], changes)
        draw_scene(figure, areas[3], scene)
        for axes in areas[1:3] if ax is None else ():
            page.legend_above(axes, 270)
        return page.save(figure, path)


def _responses(axes: Any, f: Array, curves: dict[str, tuple[Any, Any]], label: str) -> None:
    looks: tuple[dict[str, Any], ...] = (
        {"ls": "", "marker": ".", "ms": 5, "color": DOT_COLOUR},
        {"ls": "--", "lw": 1.3, "color": LINES[2]},
        {"lw": 1.6, "color": LINES[0]},
    )
    for (name, (own, values)), look in zip(curves.items(), looks, strict=False):
        axes.semilogy(own, np.abs(np.asarray(values)), label=name, **look)
    axes.set_xlim(f[0], f[-1])
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(label)
    finish(axes, legend=True)


def _changes(bars: Any, errors: Any, changes: dict[str, tuple[float, float, float]]) -> None:
    """True and found changes, and on a scale of its own how far they are apart."""
    true, found, spread = (100 * np.array(part) for part in zip(*changes.values(), strict=True))
    place = np.arange(len(changes))[::-1]
    bars.barh(place, true, height=0.72, color="#d5dae1", label="true")
    bars.plot(found, place, "o", ms=5, color=LINES[0], label="found")
    errors.errorbar(found - true, place, xerr=2 * spread, fmt="o", ms=5, color=LINES[0], capsize=4,
                    label="\u00b1 two standard deviations")  # fmt: skip
    for axes, label in ((bars, "change [%]"), (errors, "found - true [%]")):
        axes.axvline(0.0, color=LINE_COLOUR, lw=0.8)
        axes.set_yticks(place, list(changes) if axes is bars else [""] * len(changes))
        axes.set_ylim(-0.6, len(changes) - 0.4)
        axes.set_xlabel(label, size=page.BODY_SIZE)
        axes.locator_params(axis="x", nbins=4)
        finish(axes, legend=False)


def _frame(points: Array, beams: Index, sensors: Array, exciters: Array) -> Scene:
    things = {"_beams": Thing(points, beams, LINE_COLOUR, width=4.0)}
    for name, where, colour, size in (("sensors", sensors, LINES[0], 11.0),
                                      ("exciters", exciters, LINES[1], 15.0)):  # fmt: skip
        places = np.asarray(where, dtype=float)
        things[name] = Thing(places, np.arange(len(places))[:, None], colour, width=size)
    return Scene("Where it is tested", things, view=(1.0, 0.9, 0.8), up=(0, 0, 1))
