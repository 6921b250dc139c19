"""What a reader trips over in a figure of matplotlib, found from what is drawn.

- two curves of one diagram that are named differently and look the same;
- a diagram of which what is drawn takes less than half the width or half the height;
- words that leave the page, lie on other words, or stand outside of their own diagram;
- axes without a name, but those of sketches, colour bars and things in space.
"""

from itertools import combinations, groupby
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedFormatter, FuncFormatter
from matplotlib.transforms import Bbox

LEAST_SHARE = 0.5  # of a diagram's width and height, that what is drawn takes at least
SLACK = 2.0  # by which words may overlap or leave a page [pixel]


def faults(figure: Figure) -> list[str]:
    """One sentence each; empty for a figure that reads well."""
    figure.draw_without_rendering()
    diagrams = [axes for axes in figure.axes if axes.axison and axes.get_visible()]
    return [
        fault
        for axes in diagrams
        for fault in (*_alike(axes), *_empty(axes), *_without_names(axes), *_strays(axes))
    ] + _crowded(figure)


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


def _drawn(axes: Axes) -> Bbox | None:
    """The box of all that shows values, cut at the axes."""
    boxes = []
    for line in axes.lines:
        if line.get_transform() != axes.transData:
            continue  # levels and other lines across the whole diagram
        xy = axes.transData.transform(np.column_stack(line.get_data(orig=False)).astype(float))
        inside = xy[np.isfinite(xy).all(axis=1)]
        boxes += [Bbox([inside.min(axis=0), inside.max(axis=0)])] if len(inside) else []
    for artist in (*axes.collections, *axes.patches, *axes.images):
        boxes.append(artist.get_window_extent())
    boxes = [Bbox.intersection(box, axes.bbox) for box in boxes]
    boxes = [box for box in boxes if box is not None]
    return Bbox.union(boxes) if boxes else None


def _empty(axes: Axes) -> list[str]:
    box = _drawn(axes)
    if box is None:
        return [f"{_title(axes)!r} is empty"]
    shares = {"width": box.width / axes.bbox.width, "height": box.height / axes.bbox.height}
    return [f"{_title(axes)!r}: what is drawn takes {share:.0%} of the {side}"
            for side, share in shares.items() if share < LEAST_SHARE]  # fmt: skip


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
    return (
        Text.get_window_extent(text) if isinstance(text, Annotation) else text.get_window_extent()
    )


def _strays(axes: Axes) -> list[str]:
    """Words outside of the diagram that they belong to."""
    room = axes.bbox.padded(SLACK)
    return [f"{_title(axes)!r}: {text.get_text()!r} leaves the diagram" for text in _words(axes)
            if not _within(_extent(text), room)]  # fmt: skip


def _within(box: Bbox, room: Bbox) -> bool:
    return bool(np.all(box.min >= room.min) and np.all(box.max <= room.max))


def _crowded(figure: Figure) -> list[str]:
    """Words that leave the page or lie on each other; ticks of one axis are told once."""
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
    boxes = [(text, _extent(text)) for text in written]
    page = figure.bbox.padded(SLACK)
    found = [
        f"{text.get_text()!r} leaves the page" for text, box in boxes if not _within(box, page)
    ]
    for (a, one), (b, other) in combinations(boxes, 2):
        both = Bbox.intersection(one, other)
        if both is not None and min(both.width, both.height) > SLACK:
            found.append(f"{a.get_text()!r} lies on {b.get_text()!r}")
    return found
