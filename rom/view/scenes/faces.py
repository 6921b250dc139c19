"""Picture of the faces of a part, from two opposite sides, each in a colour and with its label."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt, find_objects

from rom.arguments import typed
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.offscreen import render
from rom.view.canvas.scene import TEXT_COLOUR, Actor, Camera, aimed, boundary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE_WIDTH = 1500  # [pixel]
HEADER_HEIGHT, GAP = 80, 30  # [pixel]
COLOURS = "#e9b4a6 #a9c8e0 #f2d694 #b5d6b2 #cdb7dc #9fd3cf #e3c4a0 #d9dba0 #e6b3cc #b9c3e6".split()
REST_COLOUR, EDGE_COLOUR = "#d5dae0", "#3d444d"  # faces without a label; where two faces meet
LABEL_SIZE = 8.0  # points
LETTER_SIZE = (10, 20)  # width and height of a letter of a label [pixel]
LEAST_SEEN = 2.0  # [pixel] from the edges of what is seen of a face
ROOM_SHARE = 0.9  # of the greatest such distance, from which a label may stand
WAYS = ((0, -1), (1, 0), (0, 1), (-1, 0), (1, -1), (1, 1), (-1, 1), (-1, -1))  # labels are moved
MAX_STEPS = 12  # steps of half a label, that it is moved at most
# (k, 2) half labels from the middle of a face, further and further away
AWAY = np.array([(0, 0), *((i * k, j * k) for k in range(2, MAX_STEPS) for i, j in WAYS)])


@typed
@page.picture
def faces(
    points: npt.ArrayLike,
    patches: Mapping[str, npt.ArrayLike],
    path: str | Path | None = None,
    *,
    title: str = "Faces",
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw the faces of a part with their labels, from one side and from the opposite one.

    Args:
        points: (n, 3) positions of the nodes [m].
        patches: {label: (t, 3) triangles of a face}; "" for the rest, which gets no label.
        path: picture to write, .png; None to write nothing.
        title: heading.
        view: (3,) direction from the part to the eye; None: mainly along its shortest extent.
        up: (3,) upright direction; None: across its longest extent.

    Raises:
        ConfigError: if there is no triangle, or pictures cannot be made here.
    """
    x = np.asarray(points, dtype=float)
    triangles = {label: np.asarray(t, dtype=np.int64) for label, t in patches.items()}
    if not any(map(len, triangles.values())):
        raise ConfigError("there is no face to draw; give triangles.")
    used = np.unique(np.concatenate([t.ravel() for t in triangles.values()]))
    camera = aimed(x[used], PAGE_WIDTH, view=view, up=up, heights=(0.2, 0.6))
    both = np.stack([x, _turned(x, camera)])
    images = render(list(_actors(both, triangles)), camera)
    sides = _numbers(both, triangles, camera)
    placed = [_placed(_spots(side, list(triangles)), camera.size) for side in sides]
    below = images.shape[1] + GAP
    words = _words(x[used], triangles, placed)
    figure = page.titled(PAGE_WIDTH, HEADER_HEIGHT + 2 * below, title, words)
    for k, side in enumerate(placed):
        axes = page.place(figure, images[k], 0, HEADER_HEIGHT + k * below).axes
        for spot, at in side:
            _write(axes, spot, at)
    return figure


def _turned(x: Array, camera: Camera) -> Array:
    """The part turned by half a turn about the upright direction: seen from behind."""
    arm = x - camera.focus
    return camera.focus + 2 * np.outer(arm @ camera.up, camera.up) - arm


def _actors(x: Array, triangles: Mapping[str, Index]) -> Iterator[Actor]:
    """Faces in a few colours, neighbours by number in different ones, and the lines between."""
    labels = [label for label in triangles if label]
    colours = {label: COLOURS[k % len(COLOURS)] for k, label in enumerate(labels)}
    for colour in (*COLOURS, REST_COLOUR):
        same = [t for label, t in triangles.items() if colours.get(label, REST_COLOUR) == colour]
        if sum(map(len, same)):
            yield Actor(x, np.vstack(same), colour=colour)
    edges = np.vstack([boundary(t) for t in triangles.values()])
    yield Actor(x, edges, colour=EDGE_COLOUR, width=1.2)


def _numbers(x: Array, triangles: Mapping[str, Index], camera: Camera) -> Index:
    """(2, height, width) from 1 on, the face seen in each pixel; other numbers at edges."""
    every = enumerate(triangles.values(), 1)
    flat = [Actor(x, t, colour=f"#{k:06x}", lit=False) for k, t in every if len(t)]
    r, g, b = np.moveaxis(render(flat, camera, oversampling=1).astype(np.int64), -1, 0)
    numbers = (r << 16) + (g << 8) + b
    return np.where(numbers <= len(triangles), numbers, 0)


@dataclass(frozen=True, slots=True)
class Spot:
    """A place for a label: a pixel (column, row), and how far it is from the edges of the face."""

    label: str
    at: tuple[int, int]
    room: float


def _spots(numbers: Index, labels: list[str]) -> list[Spot]:
    """The most central of the places with room on what is seen of each face with a label."""
    found = []
    for k, window in enumerate(find_objects(numbers, max_label=len(labels))):
        if window is None or not labels[k]:
            continue
        depth = distance_transform_edt(np.pad(numbers[window] == k + 1, 1))[1:-1, 1:-1]
        if depth.max() < LEAST_SEEN:
            continue
        wide = np.argwhere(depth >= ROOM_SHARE * depth.max())
        middle = np.average(np.argwhere(depth), axis=0)
        row, column = wide[np.argmin(np.linalg.norm(wide - middle, axis=1))]
        at = int(column) + window[1].start, int(row) + window[0].start
        found.append(Spot(labels[k], at, float(depth.max())))
    return found


Labels = list[tuple[Spot, tuple[float, float]]]  # and where the middle of each label is [pixel]


def _placed(spots: list[Spot], size: tuple[int, int]) -> Labels:
    """Where the middle of each label goes [pixel], none upon another; the roomiest faces first."""
    boxes, found = np.zeros((0, 2, 2)), []
    for spot in sorted(spots, key=lambda spot: -spot.room):
        half = 0.5 * np.array([LETTER_SIZE[0] * len(spot.label) + 8, LETTER_SIZE[1] + 4])
        for at in (spot.at + AWAY * half).tolist():
            low, high = at - half, at + half
            apart = ((high <= boxes[:, 0]) | (low >= boxes[:, 1])).any(axis=1)
            if (low >= 0).all() and (high <= size).all() and apart.all():
                boxes = np.append(boxes, [[low, high]], axis=0)
                found.append((spot, (at[0], at[1])))
                break
    return found


def _words(x: Array, triangles: Mapping[str, Index], placed: list[Labels]) -> str:
    """The caption: how large the part is, and what has no label."""
    size = " x ".join(f"{length:.4g} mm" for length in 1e3 * np.ptp(x, axis=0))
    labelled = {spot.label for side in placed for spot, _ in side}
    hidden = sorted(set(triangles) - labelled - {""}, key=lambda label: (len(label), label))
    words = f"The part, {size}, from one side and, below, from the opposite one."
    return words + (f" Not seen, or too small: {', '.join(hidden)}." if hidden else "")


def _write(axes: "Axes", spot: Spot, at: tuple[float, float]) -> None:
    """The label, with a line to its face where it had to be moved."""
    if at != spot.at:
        axes.plot(*zip(spot.at, at, strict=True), color=TEXT_COLOUR, linewidth=0.7)
        axes.plot(*spot.at, marker="o", markersize=2.5, color=TEXT_COLOUR)
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": TEXT_COLOUR, "lw": 0.5}
    axes.text(*at, spot.label, size=LABEL_SIZE, ha="center", va="center", bbox=box)
