"""Picture of a mechanism as its bodies are placed, each in a colour of its own."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import AnyMechanism, typed
from rom.view.canvas import page
from rom.view.canvas.corner import STRIP_HEIGHT, corner
from rom.view.canvas.offscreen import render
from rom.view.canvas.scene import Actor, Camera, aimed, sharp_edges
from rom.view.scenes.film import Look, symbols_of, together, upright
from rom.view.scenes.places import at_start, placed
from rom.view.scenes.rigid import BLOCK_OPACITY, BOX_OPACITY, bars, ends_of, shadow

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH = 1200  # [pixel]
COLOURS = ("#9aa5b1", "#2f7f9f", "#d1495b", "#edae49", "#66a182", "#8d6a9f", "#c3c9d0", "#5c636e")
MAX_LEGEND_BODIES = 16  # bodies in the legend


@typed
def start(
    mechanism: AnyMechanism,
    path: str | Path | None = None,
    *,
    title: str = "Mechanism at its start",
    symbols: bool = True,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw a mechanism before it moves: flexible bodies by their surface, rigid ones as tubes.

    Args:
        mechanism: a `Mechanism`.
        path: picture to write, .png; None to write nothing.
        title: heading.
        symbols: draw joints, springs, planes of contact and the ground, too.
        view: (3,) direction from the things to the eye [1]; None: mainly along the shortest extent.
        up: (3,) upright direction [1]; None: against gravity, or across the longest extent without.

    Raises:
        ConfigError: if pictures cannot be made here.
    """
    path = page.wanted(path)
    up = upright(mechanism) if up is None else up
    actors = start_actors(mechanism, symbols=symbols, up=up)
    points = np.concatenate([actor.points[0] for actor in actors])
    camera = aimed(points, PAGE_WIDTH, view=view, up=up)
    image = render(actors, camera)[0]
    with page.styled():
        return page.save(_sheet(mechanism, camera, image, title), path)


def start_actors(mechanism: Any, *, symbols: bool = True, up: Any = None) -> list[Actor]:
    """Bodies as they are placed, their sharp edges, and the symbols between them."""
    actors, places = [], at_start(mechanism)
    for k, part in enumerate(mechanism.parts.values()):
        surface = getattr(part.flexible, "surface", None)
        ends = ends_of(mechanism, part.name)
        mesh = bars(part, ends) if surface is None else (surface.points, surface.triangles)
        X, triangles = np.asarray(mesh[0], dtype=float), np.asarray(mesh[1], dtype=np.int64)
        points = placed(X[None], places.pose(part.name))
        opacity = 1.0 if surface is not None or ends else BLOCK_OPACITY
        colour = COLOURS[k % len(COLOURS)]
        actors.append(Actor(points, triangles, colour=colour, opacity=opacity))
        actors.append(Actor(points, sharp_edges(X, triangles), colour="#3a414b", width=1.0))
        block = None if surface is not None else shadow(part, ends)
        if block is not None:
            seen = placed(block[0][None], places.pose(part.name))
            actors.append(Actor(seen, block[1], colour=colour, opacity=BOX_OPACITY))
    more = symbols_of(places, Look({}, up=up)) if symbols else []
    return [*actors, *together(more)]


def _sheet(mechanism: Any, camera: Camera, image: Any, title: str) -> Any:
    words = (
        f"{len(mechanism.parts)} bodies as they are placed, before joints pull them together. "
        "Flexible bodies are drawn by their surface, rigid ones as tubes from the mass centre to "
        "their markers, in a block of the same mass and inertia."
    )
    names = list(mechanism.parts)[:MAX_LEGEND_BODIES]
    rows = page.packed(names, PAGE_WIDTH - 45)
    row = max((line for line, _ in rows), default=0)
    top = image.shape[0] + STRIP_HEIGHT + 90
    figure = page.titled(PAGE_WIDTH, top + 35 * (row + 1) + 15, title, words)
    page.place(figure, image, 0, 80)
    corner(figure, camera, 20, PAGE_WIDTH - 20, image.shape[0] + 80)
    for k, (name, (line, at)) in enumerate(zip(names, rows, strict=True)):
        colour = COLOURS[k % len(COLOURS)]
        page.words(figure, "\u25a0", at + 15, top + 35 * line, color=colour, size=page.TITLE_SIZE)
        page.words(figure, name, at + 41, top + 35 * line + 3, size=page.SMALL_SIZE)
    return figure
