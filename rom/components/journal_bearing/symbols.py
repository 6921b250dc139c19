"""How journal bearings are drawn."""

from collections.abc import Iterator
from typing import Any

from rom.view.canvas.scene import Actor
from rom.view.scenes.connections import circle
from rom.view.scenes.ground import Scenery


def draw(scenery: Scenery, _: str, film: Any) -> Iterator[Actor]:
    """A circle of the journal and one of the bush."""
    for marker, axis in zip((film.i, film.j), film.axes[:2], strict=True):
        yield circle(scenery.places, marker, axis, film.bearing.radius)
