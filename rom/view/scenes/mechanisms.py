"""Picture of a mechanism as its bodies are placed, each in a colour of its own."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from rom.arguments import AnyMechanism, typed
from rom.view.canvas import page
from rom.view.canvas.scene import Actor
from rom.view.canvas.solids import Mesh
from rom.view.figures.things import COLOURS as COLOURS
from rom.view.figures.things import NO_LINES, Scene, Thing, actors_of, as_thing, scene_page, seen
from rom.view.scenes.film import Look, symbols_of, together, upright
from rom.view.scenes.places import at_start, placed
from rom.view.scenes.rigid import BOX_OPACITY, form_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH = 1200  # [pixel]
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
    things = _things(mechanism, symbols=symbols, up=up)
    whole = seen(Scene(title, things, view=view, up=up), PAGE_WIDTH)
    words = (
        f"{len(mechanism.parts)} bodies as they are placed, before joints pull them together. "
        "Flexible bodies are drawn by their surface, rigid ones as tubes from the mass centre to "
        "their markers, in a block of the same mass and inertia."
    )
    with page.styled():
        return page.save(scene_page(whole, words), path)


def start_actors(mechanism: Any) -> list[Actor]:
    """Bodies as they are placed, their sharp edges, and the symbols between them."""
    return actors_of(Scene("", _things(mechanism, symbols=True, up=None)))


def _things(mechanism: Any, *, symbols: bool, up: Any) -> dict[str, Thing | Mesh]:
    places = at_start(mechanism)
    things: dict[str, Thing | Mesh] = {}
    for k, part in enumerate(mechanism.parts.values()):
        form, pose = form_of(mechanism, part.name, {}), places.pose(part.name)
        name, colour = part.name if k < MAX_LEGEND_BODIES else f"_{k}", COLOURS[k % len(COLOURS)]
        points = placed(form.points[None], pose)
        things[name] = Thing(points, form.triangles, colour, opacity=form.opacity)
        if form.block is not None:
            points = placed(form.block[0][None], pose)
            things[f"_block {k}"] = Thing(
                points, form.block[1], colour, None, BOX_OPACITY, 1.0, NO_LINES
            )
    more = together(symbols_of(places, Look({}, up=up))) if symbols else []
    return things | {f"_symbol {k}": as_thing(actor) for k, actor in enumerate(more)}
