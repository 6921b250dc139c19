"""What tells direction and size beside a picture: the axes of the world, and a round length."""

from typing import Any

import numpy as np

from rom.view.canvas import page
from rom.view.canvas.scales import round_length, written
from rom.view.canvas.scene import TEXT_COLOUR, Camera

AXIS_COLOURS = ("#c0392b", "#3a8f4d", "#2f6fb0")  # of x, y and z
TRIAD_SIZE, BAR_SIZE = 96, 130  # of the square of the axes, and of the longest bar [pixel]
STRIP_HEIGHT = 100  # of the strip that holds both [pixel]
HIDDEN_LENGTH = 0.12  # of an axis towards the eye, which is a dot


def corner(figure: Any, camera: Camera, left: float, right: float, top: float) -> None:
    """Draw both: the axes at the left end of a strip, the length at its right end.

    Args:
        figure: a page.
        camera: of the picture they belong to.
        left: end of the strip [pixel].
        right: its other end [pixel].
        top: its upper edge [pixel]; it is `STRIP_HEIGHT` high.
    """
    triad(page.area(figure, left, top, TRIAD_SIZE, TRIAD_SIZE), camera)
    length, wide = scale(camera)
    x = right - (BAR_SIZE + wide) / 2
    bar = page.area(figure, x, top + 52, wide, 10)
    bar.set_axis_off()
    bar.plot([0, 0, 0, 1, 1, 1], [0, 1, 0.5, 0.5, 1, 0], color=TEXT_COLOUR, lw=1.4, clip_on=False)
    bar.set_xlim(0, 1)
    bar.set_ylim(0, 1)
    page.words(figure, written(length, "m"), right - BAR_SIZE / 2, top + 24, size=page.SMALL_SIZE,
               ha="center")  # fmt: skip


def scale(camera: Camera) -> tuple[float, float]:
    """A round length [m] and how many pixels of the picture it takes."""
    length = round_length(BAR_SIZE / camera.metre)
    return length, length * camera.metre


def triad(axes: Any, camera: Camera) -> None:
    """The axes of the world as the camera sees them, the nearest one last."""
    axes.set_axis_off()
    axes.set_xlim(-1.45, 1.45)
    axes.set_ylim(-1.45, 1.45)
    seen = camera.axes
    for k in np.argsort(seen[:, 2]):
        x, y = seen[k, :2]
        colour, long = AXIS_COLOURS[k], float(np.hypot(x, y))
        if long > HIDDEN_LENGTH:
            arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0,
                     "mutation_scale": 8}  # fmt: skip
            axes.annotate("", (x, y), (0, 0), arrowprops=arrow)
            x, y = x * (1 + 0.26 / long), y * (1 + 0.26 / long)
        else:  # it points at the reader, or away from him
            axes.plot(0, 0, "o", color=colour, ms=5)
            x, y = -0.3, -0.3
        axes.text(x, y, "xyz"[k], color=colour, size=page.SMALL_SIZE, ha="center", va="center")
