"""Picture of a mechanism as its bodies are placed, each in a colour of its own."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import AnyMechanism, typed
from rom.rotation import matrix
from rom.view.canvas import page
from rom.view.canvas.offscreen import render
from rom.view.canvas.scene import TEXT_COLOUR, Actor, aimed, sharp_edges
from rom.view.scenes.film import bars, placed

PAGE_WIDTH = 1200  # [pixel]
COLOURS = ("#9aa5b1", "#2f7f9f", "#d1495b", "#edae49", "#66a182", "#8d6a9f", "#c3c9d0", "#5c636e")
MAX_LEGEND_BODIES = 16  # bodies in the legend


@typed
def start(
    mechanism: AnyMechanism,
    path: str | Path | None = None,
    *,
    title: str = "Mechanism at its start",
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Path | page.Picture:
    """Draw a mechanism before it moves: flexible bodies by their surface, rigid ones as bars.

    Args:
        mechanism: a `Mechanism`.
        path: picture to write, .png; None to get the `Picture` itself.
        title: heading.
        view: (3,) direction from the things to the eye [1]; None: mainly along the shortest extent.
        up: (3,) upright direction [1]; None: across the longest extent.

    Raises:
        ConfigError: if pictures cannot be made here.
    """
    path = page.wanted(path)
    actors = start_actors(mechanism)
    points = np.concatenate([actor.points[0] for actor in actors])
    image = render(actors, aimed(points, PAGE_WIDTH, view=view, up=up))[0]
    with page.styled():
        return page.save(_sheet(mechanism, image, title), path)


def start_actors(mechanism: Any) -> list[Actor]:
    """Bodies as they are placed, and their sharp edges."""
    actors = []
    for k, part in enumerate(mechanism.parts.values()):
        surface = getattr(part.flexible, "surface", None)
        mesh = bars(part) if surface is None else (surface.points, surface.triangles)
        X, triangles = np.asarray(mesh[0], dtype=float), np.asarray(mesh[1], dtype=np.int64)
        points = placed(X[None], (part.at[None], matrix(part.p)[None]))
        actors.append(Actor(points, triangles, colour=COLOURS[k % len(COLOURS)]))
        actors.append(Actor(points, sharp_edges(X, triangles), colour="#3a414b", width=1.0))
    return actors


def _sheet(mechanism: Any, image: Any, title: str) -> Any:
    words = (
        f"{len(mechanism.parts)} bodies as they are placed, before joints pull them together. "
        "Flexible bodies are drawn by their surface, rigid ones as bars from the mass centre to "
        "their markers."
    )
    text, below = page.caption(words, PAGE_WIDTH - 60)
    names = list(mechanism.parts)[:MAX_LEGEND_BODIES]
    rows, row, left = [], 0, 30
    for name in names:
        wide = 60 + 13 * len(name)
        if left + wide > PAGE_WIDTH - 30:
            row, left = row + 1, 30
        rows.append((row, left))
        left += wide
    top = image.shape[0] + 90
    figure = page.sheet(PAGE_WIDTH, top + 35 * (row + 1) + 15 + below + 20)
    page.words(figure, title, 30, 25, size=page.TITLE_SIZE, weight="bold")
    page.place(figure, image, 0, 80)
    for k, (name, (line, at)) in enumerate(zip(names, rows, strict=True)):
        colour = COLOURS[k % len(COLOURS)]
        page.words(figure, "\u25a0", at, top + 35 * line, color=colour, size=page.TITLE_SIZE)
        page.words(figure, name, at + 30, top + 35 * line + 3, size=page.BODY_SIZE)
    page.words(figure, text, 30, top + 35 * (row + 1) + 10, size=page.SMALL_SIZE, color=TEXT_COLOUR)
    return figure
