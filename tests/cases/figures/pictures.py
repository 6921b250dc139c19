"""What a reader trips over in a figure of matplotlib, found from what is drawn.

Curves that cannot be told apart, diagrams that are nearly empty or compared on two scales, words
that leave the page or lie on others, on curves or away from all that is drawn, axes without a name.
"""

from collections.abc import Sequence
from itertools import combinations, groupby
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter
from matplotlib.transforms import Bbox

LEAST_SHARE = 0.5  # of a diagram's width and height, that what is drawn takes at least
LEAST_FILLED = 0.12  # of the room of things in space and of what stands below them
FARTHEST = 30.0  # of a note from what is drawn [pixel]
SLACK = 2.0  # by which words may overlap or leave a page [pixel]


def faults(figure: Figure) -> list[str]:
    """One sentence each; empty for a figure that reads well."""
    figure.draw_without_rendering()
    shown = [axes for axes in figure.axes if axes.get_visible()]
    diagrams = [axes for axes in shown if axes.axison]
    found = [
        fault
        for axes in diagrams
        for fault in (*_alike(axes), *_hidden(axes), *_without_names(axes), *_strays(axes),
                      *_crossed(axes), *_lost(axes))
    ]  # fmt: skip
    found += [fault for alike in _compared(diagrams) for fault in (*_scales(alike), *_empty(alike))]
    found += [fault for axes in shown if not axes.axison for fault in _bare(axes)]
    return found + crowded(figure)


def _title(axes: Axes) -> str:
    return axes.get_title(loc="left") or axes.get_ylabel() or axes.get_title() or "a diagram"


def _alike(axes: Axes) -> list[str]:
    """Pairs of named curves with one colour, dash and marker."""
    named = [line for line in axes.lines if not line.get_label().startswith("_")]

    def look(line):
        return to_hex(line.get_color()), line.get_linestyle(), str(line.get_marker()), round(
            line.get_linewidth(), 1
        ), to_hex(line.get_markeredgecolor())  # fmt: skip

    found = []
    for _, group in groupby(sorted(named, key=lambda line: str(look(line))), key=look):
        names = [line.get_label() for line in group]
        found += [f"{_title(axes)!r}: {a!r} and {b!r} look the same"
                  for a, b in combinations(names, 2) if a != b]  # fmt: skip
    return found


def _seen(axes: Axes) -> list[Any]:
    """Curves and points of values, not levels and other lines across the whole diagram."""
    return [line for line in axes.lines
            if line.get_transform() == axes.transData and line.get_visible()]  # fmt: skip


def _pixels(axes: Axes, line: Any) -> np.ndarray:
    """(n, 2) its places [pixel], those that are drawn."""
    xy = axes.transData.transform(np.column_stack(line.get_data(orig=False)).astype(float))
    return xy[np.isfinite(xy).all(axis=1)]


def _hidden(axes: Axes) -> list[str]:
    """Named curves under another one that has no gaps and is as wide."""
    named = [line for line in _seen(axes) if not line.get_label().startswith("_")
             and line.get_linestyle() != "None"]  # fmt: skip
    found = []
    for one, other in combinations(named, 2):
        a, b = (line.get_xydata().filled(np.nan) if np.ma.isMaskedArray(line.get_xydata())
                else line.get_xydata() for line in (one, other))  # fmt: skip
        if a.shape != b.shape or not np.isfinite(a).any():
            continue
        apart = axes.transData.transform(a) - axes.transData.transform(b)
        if np.nanmax(np.abs(apart)) > 1.0:
            continue
        above = max((one, other), key=lambda line: (line.get_zorder(), axes.lines.index(line)))
        below = other if above is one else one
        covers = above.get_linestyle() in ("-", below.get_linestyle())
        if covers and below.get_linewidth() < above.get_linewidth() + 1.0:
            found.append(f"{_title(axes)!r}: {above.get_label()!r} hides {below.get_label()!r}")
    return found


def _compared(diagrams: list[Axes]) -> list[list[Axes]]:
    """Diagrams whose axes have the same names; others, and maps, are alone."""
    groups: dict[Any, list[Axes]] = {}
    for axes in diagrams:
        names = axes.get_xlabel(), axes.get_ylabel()
        alone = axes.images or not all(names)
        key = axes if alone else (*names, axes.get_xscale(), axes.get_yscale())
        groups.setdefault(key, []).append(axes)
    return list(groups.values())


def _scales(alike: list[Axes]) -> list[str]:
    limits = np.array([[axes.get_xlim(), axes.get_ylim()] for axes in alike])
    first, size = limits[0], np.abs(limits).max() or 1.0
    apart = (limits[:, 0, 0] > first[0, 1]) | (limits[:, 0, 1] < first[0, 0])  # other windows of x
    unlike = np.abs(limits - first).max(axis=2) > 1e-9 * size
    return [f"{_title(alike[0])!r} and {_title(axes)!r} are compared and have two scales"
            for axes, x, y in zip(alike, unlike[:, 0] & ~apart, unlike[:, 1], strict=True)
            if x or y]  # fmt: skip


def _drawn(axes: Axes) -> Bbox | None:
    """The box of all that shows values, cut at the axes."""
    boxes = []
    for line in _seen(axes):
        inside = _pixels(axes, line)
        boxes += [Bbox([inside.min(axis=0), inside.max(axis=0)])] if len(inside) else []
    for artist in (*axes.collections, *axes.patches, *axes.images):
        boxes.append(artist.get_window_extent())
    boxes = [Bbox.intersection(box, axes.bbox) for box in boxes]
    boxes = [box for box in boxes if box is not None]
    return Bbox.union(boxes) if boxes else None


def _empty(alike: list[Axes]) -> list[str]:
    boxes = [_drawn(axes) for axes in alike]
    found = [f"{_title(axes)!r} is empty" for axes, box in zip(alike, boxes, strict=True)
             if box is None]  # fmt: skip
    parts = [box.transformed(axes.transAxes.inverted())
             for axes, box in zip(alike, boxes, strict=True) if box is not None]  # fmt: skip
    if not parts:
        return found
    whole = Bbox.union(parts)
    if any(max(box.width, box.height) < LEAST_SHARE / 2 for box in parts):
        found.append(f"{_title(alike[0])!r} is compared with what is far smaller")
    return found + [f"{_title(alike[0])!r}: what is drawn takes {share:.0%} of the {side}"
            for side, share in (("width", whole.width), ("height", whole.height))
            if share < LEAST_SHARE]  # fmt: skip


def _bare(axes: Axes) -> list[str]:
    """Pictures of things in space that leave nearly all of their room white."""
    found = []
    for image in axes.images:
        inked = (np.asarray(image.get_array())[..., :3] < 250).any(axis=2)
        wide, tall = (np.ptp(np.flatnonzero(inked.any(axis=k))) + 1 if inked.any() else 0
                      for k in (0, 1))  # fmt: skip
        share = wide * tall / axes.bbox.width / axes.bbox.height
        if share < LEAST_FILLED:
            found.append(f"{_title(axes)!r}: things take {share:.0%} of their room")
    return found


def _without_names(axes: Axes) -> list[str]:
    """Axes with numbers and without a name; those of colour bars stand above them."""
    if hasattr(axes, "_colorbar") or not len(axes.get_yticks()):
        return []
    return [f"{_title(axes)!r}: the {side} axis has no name"
            for side, axis in (("horizontal", axes.xaxis), ("vertical", axes.yaxis))
            if not axis.label.get_text() and _has_numbers(axis)]  # fmt: skip


def _has_numbers(axis: Any) -> bool:
    shown = any(tick.label1.get_visible() for tick in axis.get_major_ticks())
    return shown and not isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter)


def _words(axes: Axes) -> list[Text]:
    """What is written into a diagram, beside its title and names of axes."""
    return [text for text in axes.texts if text.get_visible() and text.get_text().strip()]


def _extent(text: Text) -> Bbox:
    """Of the words alone, without an arrow."""
    return Text.get_window_extent(text)


def _strays(axes: Axes) -> list[str]:
    """Words outside of the diagram that they belong to."""
    room = axes.bbox.padded(SLACK)
    return [f"{_title(axes)!r}: {text.get_text()!r} leaves the diagram" for text in _words(axes)
            if not _within(_extent(text), room)]  # fmt: skip


def _crossed(axes: Axes) -> list[str]:
    """Words that a curve runs through, but those on paper of their own, or that hide a point."""
    found = []
    points = [_pixels(axes, line) for line in _seen(axes) if line.get_linestyle() == "None"]
    for text in _words(axes):
        box = _extent(text).padded(-1.0)
        if any(box.contains(*xy) for places in points for xy in places):
            found.append(f"{_title(axes)!r}: {text.get_text()!r} hides a point")
        if text.get_bbox_patch() is None and any(
            line.get_path().transformed(line.get_transform()).intersects_bbox(box, filled=False)
            for line in axes.lines if line.get_linestyle() != "None"
        ):  # fmt: skip
            found.append(f"{_title(axes)!r}: a curve runs through {text.get_text()!r}")
    return found


def _lost(axes: Axes) -> list[str]:
    """Notes inside of a diagram, away from everything."""
    places = [line.get_path().transformed(axes.transData).interpolated(30).vertices
              for line in _seen(axes)]  # fmt: skip
    if not places or axes.images or axes.collections:
        return []
    found, points = [], np.nan_to_num(np.concatenate(places), nan=np.inf)
    for text in _words(axes):
        box = _extent(text)
        gap = np.maximum(0.0, np.maximum(box.min - points, points - box.max))
        if axes.bbox.overlaps(box) and np.linalg.norm(gap, axis=1).min() > FARTHEST:
            found.append(f"{_title(axes)!r}: {text.get_text()!r} stands away from what it names")
    return found


def _within(box: Bbox, room: Bbox) -> bool:
    return bool(np.all(box.min >= room.min) and np.all(box.max <= room.max))


def written_in(figure: Figure) -> list[Text]:
    """All words of a figure; ticks of one axis are told once."""
    written = [text for text in figure.texts if text.get_text().strip()]
    for axes in figure.axes:
        if not axes.get_visible():
            continue
        written += [t for t in (axes.title, axes._left_title, axes._right_title) if t.get_text()]
        if not axes.axison:
            continue
        written += _words(axes)
        legend = axes.get_legend()
        written += legend.get_texts() if legend else []
        for axis in (axes.xaxis, axes.yaxis):
            written += [axis.label] if axis.label.get_text() else []
            low, high = sorted(axis.get_view_interval())
            written += [tick.label1 for tick in axis.get_major_ticks()
                        if tick.label1.get_visible() and tick.label1.get_text()
                        and low <= tick.get_loc() <= high]  # fmt: skip
    return written


def crowded(figure: Figure, more: Sequence[Text] = ()) -> list[str]:
    """Words, and more of them, that leave the page or lie on each other."""
    boxes = [(text, _extent(text)) for text in (*written_in(figure), *more)]
    page = figure.bbox.padded(SLACK)
    away = (text.get_text() for text, box in boxes if not _within(box, page))
    found = [f"{words!r} leaves the page" for words in away]
    for (a, one), (b, other) in combinations(boxes, 2):
        both = Bbox.intersection(one, other)
        if both is not None and min(both.width, both.height) > SLACK:
            found.append(f"{a.get_text()!r} lies on {b.get_text()!r}")
    return found
