"""Curves over time, and how far reduced frequencies are from full ones."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import AnySolution, one_each, typed
from rom.errors import ConfigError
from rom.io.history import asked
from rom.model import Array
from rom.view.canvas import page
from rom.view.canvas.scales import readable, without_round_off
from rom.view.figures.things import Scene, draw_scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

    from rom.mbs.analysis.campbell import Campbell

Draw = Callable[["Axes", Any, dict[str, int]], None]
PAGE_WIDTH, PANEL_HEIGHT, BESIDE_WIDTH, SCENE_GAP = 1400, 330, 440, 45  # pixel
LINES = ("#2f7f9f", "#d1495b", "#edae49", "#66a182", "#8d6a9f", "#5c636e")
DASHES = ("-", "--", "-.", ":")
# one more than colours, so that series beyond these look different, too
MARKERS = ("o", "s", "^", "D", "v", "x", "P")
GREY = "#5c636e"
LEVEL_STYLE: page.Style = {"color": GREY, "ls": "-.", "lw": 0.9, "zorder": 1.5}
RAYS_LABEL = "multiples of the speed"
MAX_TICKS = 10  # sizes that have room for a tick each
TICK_DISTANCE = 0.03  # least distance of words of ticks, of a logarithmic axis
COVER_DISTANCE, COVER_WIDTH = 1.5, 2.4  # apart [pixel]; by which a curve below is wider [point]
OF_MOTIONS = "Positions, velocities, forces: x, y, z of the world; angular velocities: of the body."
MIN_ERROR = 1e-12  # errors below are drawn there: round-off has no meaning


@typed
@page.picture
def history(  # noqa: PLR0913  keywords of one picture
    t: npt.ArrayLike | AnySolution,
    panels: Sequence[tuple[str, Mapping[str, object]] | str] | str = (),
    path: str | Path | None = None,
    *,
    title: str = "",
    caption: str = "",
    over: str | None = None,
    beside: Scene | Sequence[Scene] | None = None,
    ax: object = None,
) -> "Figure":
    """Draw quantities over time, or over something else, one panel below the other.

    Args:
        t: (n,) time [s], or values of what is named by ``over``; or a motion.
        panels: (label of the axis with its unit, {name: (n,) values}) from top to bottom; of a
            motion names of what is asked, as "slider", "crank.pin" or "pivot angle"; a pair
            (times, values) is drawn as points, a curve of `rom.certify_motion` with a band as wide
            as its error, a single number as a thin level line; values that are words become rows,
            the first word lowest.
        path: picture to write, .png; None to write nothing.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        over: label of the horizontal axis, with its unit, when that is not time.
        beside: one or more scenes from top to bottom to which the curves belong.
        ax: Axes of matplotlib, one for each panel, then each scene; None for a page of its own.

    Returns:
        The figure; that of ``ax`` where it is given.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    motion: Any = t
    shown: Any = panels
    if hasattr(t, "mechanism"):
        title, caption = title or "Motion over time", caption or OF_MOTIONS
        motion, shown = motion.t, _panels_of(motion, panels)
    times = np.asarray(motion, dtype=float)
    names = [list(filter(None, curves)) for _, curves in shown]
    figure, areas = _panels(ax, names, "history", title, caption, beside)
    numbers = numbered([list(curves) for _, curves in shown])
    for axes, (label, curves), looks in zip(areas, shown, numbers, strict=True):
        _histories(axes, times, curves, looks)
        axes.set(ylabel=label, xlim=(times[0], times[-1]))
    _complete(areas, over or "time [s]", ax)
    return figure


def _panels_of(motion: Any, names: Any) -> list[tuple[str, dict[str, object]]]:
    """What is asked of a motion, quantities of one name and unit in one panel."""
    found: dict[str, dict[str, object]] = {}
    for channel in asked(motion, (names,) if isinstance(names, str) else names):
        curves = found.setdefault(f"{channel.path[-1]} [{channel.unit}]", {})
        owner = " ".join(channel.path[1:-1]).replace(" markers ", " ")
        values = channel.values.reshape(len(motion.t), -1)
        curves |= {
            f"{owner} {x}".strip(): y for x, y in zip(channel.columns, values.T, strict=True)
        }
    return list(found.items())


def numbered(panels: Sequence[Sequence[str]]) -> list[list[int]]:
    """Number of the look of each curve: a name looks the same in all panels."""
    known: dict[str, int] = {}
    numbers = []
    for names in panels:
        taken = {known[name] for name in names if name in known}
        free = iter(k for k in range(len(names) + len(known)) if k not in taken)
        numbers.append([known[name] if name in known else next(free) for name in names])
        known |= {name: k for name, k in zip(names, numbers[-1], strict=True) if name}
    return numbers


def _histories(
    axes: "Axes", t: Array, curves: Mapping[str, object], numbers: Sequence[int]
) -> None:
    lines, looks = [], []
    for (name, values), number in zip(curves.items(), numbers, strict=True):
        look, where = line_look(number), t
        if isinstance(values, tuple) and len(values) == 3:
            where, values, error = (np.asarray(x, dtype=float) for x in values)
            one_each(f"values of {name!r}", values.shape, "times", where.shape)
            edges = values - np.abs(error), values + np.abs(error)
            axes.fill_between(where, *edges, color=look["color"], alpha=0.25, lw=0)
        elif isinstance(values, tuple):
            where, values = values
            look |= {"ls": "none", "marker": "o", "ms": 7, "clip_on": False}
        elif (given := np.asarray(values)).ndim == 0:
            values = np.full_like(t, given)
            look |= LEVEL_STYLE
        elif given.dtype.kind == "U":
            words = list(dict.fromkeys(given))
            axes.set_yticks(range(len(words)), words)
            values = [words.index(word) for word in given]
        x, y = (np.asarray(v, dtype=float) for v in (where, values))
        one_each(f"values of {name!r}", y.shape, "times", x.shape)
        lines.append((x, y))
        looks.append(look | {"label": name})
    flat = without_round_off([y for _, y in lines])
    for (x, _), y, look in zip(lines, flat, looks, strict=True):
        axes.plot(x, y, **look)


def line_look(k: int) -> page.Style:
    """Colour and dashes of curve number k, no two of the first 24 alike; dashes lie on top."""
    again, colour = divmod(k, len(LINES))
    dash = (k + again) % 2 + 2 * (again // 2 % 2)
    return {"color": LINES[colour], "ls": DASHES[dash], "lw": 1.4, "zorder": 2.0 + 0.1 * dash}


def _complete(areas: Sequence["Axes"], xlabel: str, ax: object) -> None:
    """Names of axes; on a page, not in axes of a caller, one horizontal axis and legends above."""
    for axes in areas:
        axes.set_xlabel(xlabel)
    one_scale(areas)
    for axes in areas:
        finish(axes, legend=ax is not None)
    if ax is not None:
        return
    names = [axes.get_legend_handles_labels()[1] for axes in areas]
    for axes, once in zip(areas, _once(names), strict=True):
        if once:
            page.legend_above(axes, axes.get_window_extent().width)
        if axes is not areas[-1]:
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)


@typed
@page.picture
def frequencies(
    comparison: dict[str, Any],
    path: str | Path | None = None,
    *,
    title: str = "",
    beside: Scene | Sequence[Scene] | None = None,
    ax: object = None,
) -> "Figure":
    """Draw the relative errors of reduced frequencies in several supports.

    Args:
        comparison: {support: {"full": [Hz], "reduced": [Hz]}}, as in the provenance of a body.
        path: picture to write, .png; None to write nothing.
        title: heading.
        beside: one or more scenes from top to bottom of what vibrates.
        ax: Axes of matplotlib, and one for each scene; None for a page of its own.

    Raises:
        ConfigError: without a comparison, or if pictures cannot be made here.
    """
    comparison = {support: table for support, table in comparison.items() if table["full"]}
    if not comparison:
        raise ConfigError("there is nothing to compare; give a table of one support.")
    caption = (
        "Relative error of the natural frequencies of the reduced body against the full finite "
        "element model, for each support of its interfaces; the dashed line is 0.1 %. Reduced "
        "frequencies are never below full ones."
    )
    figure, (axes,) = _panels(ax, [[*comparison]], "frequencies", title, caption, beside)
    for k, (support, table) in enumerate(comparison.items()):
        full, reduced = (np.array(table[key]) for key in ("full", "reduced"))
        error = np.maximum(np.abs(reduced / full - 1), MIN_ERROR)
        look = line_look(k) | {"marker": MARKERS[k % len(MARKERS)]}
        look["ms"] = max(4, 10 - 2 * k)  # curves may coincide
        axes.semilogy(np.arange(1, full.size + 1), error, label=support, **look)
    axes.axhline(1e-3, color=GREY, lw=1.0, ls="--")
    axes.set_xticks(range(1, max(len(table["full"]) for table in comparison.values()) + 1))
    axes.set_ylabel("relative error")
    _complete([axes], "elastic mode", ax)
    return figure


@typed
@page.picture
def convergence(
    panels: Sequence[tuple[str, Mapping[str, tuple[object, object]]]],
    path: str | Path | None = None,
    *,
    xlabel: str,
    title: str = "",
    caption: str = "",
    beside: Scene | Sequence[Scene] | None = None,
    ax: object = None,
) -> "Figure":
    """Draw errors that fall with the size of a model, on logarithmic axes.

    Args:
        panels: (label of the axis, {name: (sizes (n,), errors (n,))}) from top to bottom; errors
            at or below round-off are drawn at 1e-12.
        path: picture to write, .png; None to write nothing.
        xlabel: what the sizes count.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        beside: one or more scenes from top to bottom to which the errors belong.
        ax: Axes of matplotlib, one for each panel, then each scene; None for a page of its own.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
    """
    names = [[*curves] for _, curves in panels]
    figure, areas = _panels(ax, names, "convergence", title, caption, beside)
    for axes, (label, curves) in zip(areas, panels, strict=True):
        for k, (name, (sizes, errors)) in enumerate(curves.items()):
            x, y = np.asarray(sizes, dtype=float), np.asarray(errors, dtype=float)
            one_each(f"errors of {name!r}", y.shape, "sizes", x.shape)
            look = {"color": LINES[k % len(LINES)], "marker": MARKERS[k % len(MARKERS)]}
            axes.loglog(x, np.maximum(np.abs(y), MIN_ERROR), label=name, **look)
        axes.set_ylabel(label)
        near_ticks(axes.yaxis)
    _same_sizes(areas, [x for _, curves in panels for x, _ in curves.values()])
    _complete(areas, xlabel, ax)
    return figure


@typed
@page.picture
def campbell(  # noqa: PLR0913  keywords of one picture
    diagram: Any,
    path: str | Path | None = None,
    *,
    orders: Sequence[float] = (1.0,),
    names: Sequence[str] = (),
    marks: dict[str, float] | None = None,
    title: str = "",
    caption: str = "",
    beside: Scene | Sequence[Scene] | None = None,
    ax: object = None,
) -> "Figure":
    """Draw natural frequencies over the speed of rotation, with multiples of the speed.

    A ring marks where a mode meets a multiple of the speed. A second panel shows damping, if any.

    Args:
        diagram: what `rom.campbell` returned.
        path: picture to write, .png; None to write nothing.
        orders: multiples of the speed to draw [1].
        names: one per mode, in the order of the columns; without names modes are numbered.
        marks: {name: speed [rad/s]} drawn as upright lines.
        title: heading.
        caption: what a stranger has to know; not written into axes of yours.
        beside: one or more scenes from top to bottom of what vibrates.
        ax: Axes of matplotlib, two with damping, then one a scene; None for a page of its own.

    Raises:
        ConfigError: if there is not one name per mode, or pictures cannot be made here.
    """
    f, damping = (
        np.stack(without_round_off(list(values.T)), axis=1)
        for values in (diagram.frequencies, 100 * diagram.damping_ratios)
    )
    if names:
        one_each("names", len(names), "modes", f.shape[1])
    labels = names or [f"mode {k + 1}" for k in range(f.shape[1])]
    turns = 30 * diagram.speeds / np.pi
    damped = np.abs(damping).max(initial=0.0) > 1e-3
    panels = {"frequency [Hz]": f} | ({"damping [% of critical]": damping} if damped else {})
    legends = [[*labels, RAYS_LABEL, *(marks or {})], [*labels, *(marks or {})]][: len(panels)]
    figure, areas = _panels(ax, legends, "campbell", title, caption, beside)
    for axes, (label, values) in zip(areas, panels.items(), strict=True):
        for k, name in enumerate(labels):
            axes.plot(turns, values[:, k], label=name, **line_look(k))
        axes.set(ylabel=label, xlim=(turns[0], turns[-1]))
    _multiples(areas[0], diagram, turns, orders)
    for axes in areas:
        for name, speed in (marks or {}).items():
            axes.axvline(30 * speed / np.pi, label=name, **LEVEL_STYLE)
    _name_rays(areas[0], turns, orders)
    _complete(areas, "speed [1/min]", ax)
    return figure


def _multiples(axes: "Axes", diagram: "Campbell", turns: Array, orders: Sequence[float]) -> None:
    """Rays of the orders, and rings where modes meet them."""
    axes.set_ylim(0.0, 1.06 * diagram.frequencies.max())
    for k, order in enumerate(orders):
        axes.plot(turns, order * turns / 60, color=GREY, lw=0.9, label=None if k else RAYS_LABEL)
        at = 30 * np.array([speed for _, speed in diagram.crossings(order)]) / np.pi
        axes.plot(at, order * at / 60, "o", ms=11, mfc="none", mec="#1d2733", mew=1.3)


def _name_rays(axes: "Axes", turns: Array, orders: Sequence[float]) -> None:
    """Names below the rays, as far out as there is room where no line runs through them."""
    paths = [line.get_path().transformed(line.get_transform()) for line in axes.lines]
    for order in orders:
        look: page.Style = {"va": "top", "color": GREY, "size": page.SMALL_SIZE}
        text = axes.annotate(f"{order:g}x", (0, 0), (3, -3), textcoords="offset points", **look)

        def crossed(x: float, text: "Annotation" = text, slope: float = order / 60) -> float:
            text.xy = x, slope * x
            box = text.get_window_extent()
            if not axes.bbox.containsx(box.x1) or not axes.bbox.containsy(box.y0):
                return np.inf
            return sum(path.intersects_bbox(box, filled=False) for path in paths)

        out = min(turns[-1], 60 * axes.get_ylim()[1] / order)
        if crossed(min(np.linspace(out, turns[0], 60), key=crossed)):
            text.set_bbox({"fc": "white", "ec": "none", "pad": 0.5})


def _apart(ticks: Iterable[float], span: float) -> list[str]:
    """Words of ticks on a logarithmic axis of that span; none where they would overlap."""
    words, last = [], 0.0
    for tick in ticks:
        clear = tick >= last * span**TICK_DISTANCE
        words.append(f"{tick:g}" if clear else "")
        last = tick if clear else last
    return words


def _same_sizes(areas: Sequence["Axes"], sizes: list[object]) -> None:
    """One horizontal axis for all panels, with ticks at the sizes themselves if they are few."""
    ticks = np.unique(np.concatenate([np.asarray(x, dtype=float) for x in sizes]))
    low, high = ticks[0] / 1.15, ticks[-1] * 1.15
    if ticks.size > MAX_TICKS:
        ticks = _round(low, high)
    for axes in areas:
        axes.set_xticks(ticks, _apart(ticks, high / low))
        axes.minorticks_off()
        axes.set_xlim(low, high)


def near_ticks(axis: "Axis") -> None:
    """Ticks at 1, 2 and 5 where values on a logarithmic axis span too little for powers of ten."""
    from matplotlib.ticker import NullFormatter

    low, high = axis.get_view_interval()
    if high < 100 * low:
        ticks = _round(low, high)
        axis.set_ticks(ticks, [f"{x:g}" for x in ticks])
        axis.set_minor_formatter(NullFormatter())


def _round(low: float, high: float) -> Array:
    powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    ticks = np.outer(powers, (1.0, 2.0, 5.0)).ravel()
    return ticks[(ticks >= low) & (ticks <= high)]


def _once(legends: Sequence[Sequence[str]]) -> list[list[str]]:
    """Names of each legend; none where they are those of the first one."""
    first = list(legends[0])
    return [first, *([] if list(names) == first else list(names) for names in legends[1:])]


def _panels(
    ax: object,
    legends: Sequence[Sequence[str]],
    name: str,
    title: str,
    caption: str,
    beside: Scene | Sequence[Scene] | None,
) -> tuple["Figure", list["Axes"]]:
    """Figure and axes: those of the caller, or one below the other on a page with their legends."""
    scenes, n = [beside] if isinstance(beside, Scene) else list(beside or ()), len(legends)
    width = PAGE_WIDTH - 190 - (BESIDE_WIDTH + 30 if scenes else 0)
    rows = np.array([page.legend_shape(names, width)[0] for names in _once(legends)])
    feet = 60 + np.cumsum(PANEL_HEIGHT + 25 + page.ROW_HEIGHT * rows)
    places = [(150.0, foot - PANEL_HEIGHT, width, PANEL_HEIGHT) for foot in feet]
    tall = (feet[-1] - 45 + SCENE_GAP) / max(1, len(scenes))
    left = PAGE_WIDTH - BESIDE_WIDTH - 20
    places += [(left, 105 + k * tall, BESIDE_WIDTH, tall - SCENE_GAP) for k in range(len(scenes))]
    size = PAGE_WIDTH, int(feet[-1]) + 85
    figure, areas = page.areas(ax, places, name, size, title, caption)
    if ax is not None and title:
        areas[0].set_title(title, loc="left")
    for axes, scene in zip(areas[n:], scenes, strict=True):
        draw_scene(figure, axes, scene, scenes)
    return figure, areas[:n]


def finish(
    axes: "Axes", *, legend: bool, alike: bool = False, size: float = page.BODY_SIZE
) -> None:
    """Grid, spines, units, size of the names of axes, and legend of the house."""
    _uncover(axes)
    readable(axes, alike=alike)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_fontsize(size)
    axes.tick_params(labelsize=page.SMALL_SIZE)
    if not axes.images:
        axes.grid(color="#dfe3e8", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    if legend and axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize=page.SMALL_SIZE, framealpha=0.9, edgecolor="none")


def legend_names(drawing: Any) -> list[str]:
    """Names of a diagram that stand in its legend."""
    names = (*drawing.curves, *drawing.points, *(getattr(drawing, "ends", None) or ()))
    return [name for name in names if not name.startswith("_")]


def fill(
    figure: "Figure", areas: Sequence["Axes"], drawings: Sequence[Any], draw: Draw, *, legend: bool
) -> None:
    """Draw diagrams and scenes of a page into its areas, those compared in one scale.

    A diagram is drawn by ``draw(axes, drawing, {name of a curve: number of its look})``.
    """
    scenes = [drawing for drawing in drawings if isinstance(drawing, Scene)]
    drawn = []
    for axes, drawing in zip(areas, drawings, strict=True):
        if isinstance(drawing, Scene):
            draw_scene(figure, axes, drawing, scenes)
        else:
            drawn.append((axes, drawing))
    names = [[name for name in x.curves if not name.startswith("_")] for _, x in drawn]
    for (axes, x), own, looks in zip(drawn, names, numbered(names), strict=True):
        draw(axes, x, dict(zip(own, looks, strict=True)))
    one_scale([axes for axes, x in drawn if getattr(x, "extent", None) is None])
    for axes, x in drawn:
        if x.equal and not axes.images:
            _same_scale(axes)
        finish(axes, legend=legend, alike=x.equal, size=page.SMALL_SIZE)


def _uncover(axes: "Axes") -> None:
    """A curve with a name is wider if it lies under another of its dashes, so that it shows."""
    pixels = axes.transData.transform
    named = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
    seen = [(line, line.get_linestyle(), pixels(line.get_xydata())) for line in named]
    seen = [one for one in seen if one[1] != "None"]
    for k, (line, dashes, x) in enumerate(seen):
        alike = [y for _, other, y in seen[k + 1 :] if dashes == other and x.shape == y.shape]
        above = sum(np.allclose(x, y, 0.0, COVER_DISTANCE, equal_nan=True) for y in alike)
        line.set_linewidth(line.get_linewidth() + COVER_WIDTH * above)


def one_scale(areas: Sequence["Axes"]) -> None:
    """The same limits for diagrams whose axes have the same names: they are compared.

    Ranges of x that have nothing in common stay: each would leave the others empty.
    """
    groups: dict[tuple[str, ...], list[Axes]] = {}
    for axes in areas:
        names = axes.get_xlabel(), axes.get_ylabel()
        if all(names):
            groups.setdefault((*names, axes.get_xscale(), axes.get_yscale()), []).append(axes)
    for alike in (group for group in groups.values() if len(group) > 1):
        x, y = ([getattr(axes, f"get_{k}lim")() for axes in alike] for k in "xy")
        for axes in alike:
            if np.max(x, axis=0)[0] < np.min(x, axis=0)[1]:
                axes.set_xlim(np.min(x), np.max(x))
            axes.set_ylim(np.min(y), np.max(y))


def _same_scale(axes: "Axes") -> None:
    """Widen the shorter axis until a metre is as long on both."""
    shape = axes.get_window_extent().size
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    half = 0.5 * (np.ptp(limits, axis=1) / shape).max() * shape
    x, y = limits.mean(axis=1, keepdims=True) + np.outer(half, (-1, 1))
    axes.set(xlim=x, ylim=y)
