"""Responses before and after an update, what was changed, and sensors and forces on a body."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, one_each, typed
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.solids import Mesh, ellipsoid, joined, tube
from rom.view.figures.curves import LINES, finish
from rom.view.figures.things import Scene, Thing, draw_scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE_WIDTH, TOP_HEIGHT, BOTTOM_HEIGHT = 1500, 430, 430  # pixel
DOT_COLOUR, LINE_COLOUR = "#8b929c", "#6b7480"
BALL_SIZE, ARROW_SIZE, GAP_WIDTH = 0.012, 0.09, 0.003  # of a body's length
BODY_COLOUR, BODY_OPACITY = "#c3c9d0", 0.55


@typed
@page.picture
def updating(  # noqa: PLR0913  keywords of one picture
    f: npt.ArrayLike,
    curves: Mapping[str, object],
    changes: dict[str, tuple[float, float, float]],
    path: str | Path | None = None,
    *,
    structure: tuple[Array, Index, Array, Array] | Scene,
    label: str,
    title: str = "",
    caption: str = "",
    ax: object = None,
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
        ax: four Axes of matplotlib, for responses, changes, errors and structure; None for a page.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    f = np.asarray(f, dtype=float)
    lines = {name: x if isinstance(x, tuple) else (f, x) for name, x in curves.items()}
    for name, (own, values) in lines.items():
        one_each(f"values of {name!r}", np.shape(values), "frequencies", np.shape(own))
    scene = structure if isinstance(structure, Scene) else _frame(*structure)
    top = 85 + TOP_HEIGHT + 145
    places = [(130, 85, PAGE_WIDTH - 170, TOP_HEIGHT)]
    places += [(left, top, 270, BOTTOM_HEIGHT) for left in (250, 560)]
    places += [(880, top - 10, 590, BOTTOM_HEIGHT + 85)]
    size = PAGE_WIDTH, top + BOTTOM_HEIGHT + 75
    figure, areas = page.areas(ax, places, "updating", size, title, caption)
    _responses(areas[0], f, lines, label)
    _changes(areas[1], areas[2], changes)
    draw_scene(figure, areas[3], scene)
    for axes in areas[1:3] if ax is None else ():
        page.legend_above(axes, 270)
    return figure


def _responses(
    axes: "Axes", f: Array, curves: Mapping[str, tuple[object, object]], label: str
) -> None:
    looks: tuple[page.Style, ...] = (
        {"ls": "", "marker": ".", "ms": 5, "color": DOT_COLOUR},
        {"ls": "--", "lw": 1.3, "color": LINES[2]},
        {"lw": 1.6, "color": LINES[0]},
    )
    for (name, (own, values)), look in zip(curves.items(), looks, strict=False):
        axes.semilogy(own, np.abs(np.asarray(values)), label=name, **look)
    axes.set(xlim=(f[0], f[-1]), xlabel="frequency [Hz]", ylabel=label)
    finish(axes, legend=True)


def _changes(bars: "Axes", errors: "Axes", changes: dict[str, tuple[float, float, float]]) -> None:
    """True and found changes, and on a scale of its own how far they are apart."""
    true, found, spread = (100 * np.array(part) for part in zip(*changes.values(), strict=True))
    place = np.arange(len(changes))[::-1]
    bars.barh(place, true, height=0.72, color="#d5dae1", label="true")
    bars.plot(found, place, "o", ms=5, color=LINES[0], label="found")
    look: page.Style = {"ms": 5, "color": LINES[0], "label": "\u00b1 two standard deviations"}
    errors.errorbar(found - true, place, xerr=2 * spread, fmt="o", capsize=4, **look)
    for axes, label in ((bars, "change [%]"), (errors, "found - true [%]")):
        axes.axvline(0.0, color=LINE_COLOUR, lw=0.8)
        axes.set_yticks(place, list(changes) if axes is bars else [""] * len(changes))
        axes.set_ylim(-0.6, len(changes) - 0.4)
        axes.set_xlabel(label, size=page.BODY_SIZE)
        axes.locator_params(axis="x", nbins=4)
        finish(axes, legend=False)


def _frame(points: Array, beams: Index, sensors: Array, exciters: Array) -> Scene:
    things = {"_beams": Thing(points, beams, LINE_COLOUR, width=4.0)}
    rows = ("sensors", sensors, LINES[0], 11.0), ("exciters", exciters, LINES[1], 15.0)
    for name, where, colour, size in rows:
        places = np.asarray(where, dtype=float)
        things[name] = Thing(places, np.arange(len(places))[:, None], colour, width=size)
    return Scene("Where it is tested", things, view=(1.0, 0.9, 0.8), up=(0, 0, 1))


@typed
def channels(
    surface: Mesh,
    several: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    *,
    title: str = "",
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Scene:
    """A body with channels on it, to be drawn by `plane`, alone or beside diagrams.

    A ball is where a channel was given, its bar the direction; a thin line leads from there to the
    point of the surface that is taken for it.

    Args:
        surface: points (s, 3) [m] and triangles of the body.
        several: {name: (points (k, 3) [m], directions (k, 3) [1])}, of a plan or a test.
        title: above the picture.
        view: see `Scene`.
        up: see `Scene`.

    Raises:
        ConfigError: for a group of another shape, or a direction of length zero.

    Example:
        >>> body = rom.load("beam.rom.npz")
        >>> on = body.surface.points[:2], [[0, 1, 0], [0, 0, 1]]
        >>> scene = rom.view.channels((body.surface.points, body.surface.triangles), {"test": on})
        >>> list(scene.things)
        ['body', 'test']
    """
    points, triangles = np.asarray(surface[0], dtype=float), surface[1]
    size = float(np.ptp(points, axis=0).max())
    things: dict[str, Thing | Mesh] = {
        "body": Thing(points, triangles, BODY_COLOUR, opacity=BODY_OPACITY)
    }
    for name, (where, along) in several.items():
        x, d = (np.atleast_2d(finite(name, A, None)) for A in (where, along))
        if x.shape != d.shape or x.shape[1:] != (3,) or not np.linalg.norm(d, axis=1).all():
            raise ConfigError(f"{name!r}: {x.shape} points, {d.shape} directions, not (k, 3) each.")
        things[name] = joined([part for k in range(len(x)) for part in _channel(x[k], d[k], size)])
        gaps = [gap for p in x if (gap := _gap(p, points, size)) is not None]
        if gaps:
            things[f"{name}, off the surface"] = joined(gaps)
    return Scene(title, things, view=view, up=up)


def _channel(x: Array, d: Array, size: float) -> list[Mesh]:
    end = x + ARROW_SIZE * size * d / np.linalg.norm(d)
    ball = ellipsoid((BALL_SIZE * size,) * 3, x, sides=12)
    return [ball, tube([x, end], 0.7 * BALL_SIZE * size, sides=8)]


def _gap(x: Array, points: Array, size: float) -> Mesh | None:
    """A line to the nearest point of the surface, unless it is hidden in the ball."""
    near = points[np.linalg.norm(points - x, axis=1).argmin()]
    if np.linalg.norm(near - x) <= BALL_SIZE * size:
        return None
    return tube([x, near], GAP_WIDTH * size, sides=6)
