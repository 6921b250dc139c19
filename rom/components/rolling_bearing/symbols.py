"""How rolling bearings are drawn."""

from collections.abc import Iterator
from typing import Any

from rom.view.canvas.scene import Actor
from rom.view.scenes.connections import circle
from rom.view.scenes.ground import Scenery


def draw(scenery: Scenery, _: str, row: Any) -> Iterator[Actor]:
    """The circle of the middles of its balls or rollers."""
    yield circle(scenery.places, row.j, row.axes[2], 0.5 * row.bearing.pitch_diameter)
