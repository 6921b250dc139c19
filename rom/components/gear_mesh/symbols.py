"""How gear meshes are drawn."""

from collections.abc import Iterator

import numpy as np

from rom.components.gear_mesh.gears.meshes import GearMesh
from rom.mbs.parts.bodies import Marker
from rom.model import Array
from rom.view.canvas.scene import Actor
from rom.view.scenes.connections import LINE_WIDTH
from rom.view.scenes.ground import Scenery, lines
from rom.view.scenes.places import Places


def draw(scenery: Scenery, _: str, mesh: GearMesh) -> Iterator[Actor | tuple[Marker, Array, float]]:
    """The circles that roll on each other, and the line of a rack."""
    yield from zip((mesh.i, mesh.j), mesh.axes[::2], map(float, mesh.pair.r), strict=False)
    if not mesh.pair.teeth[1]:
        yield _rack(scenery.places, mesh)


def _rack(places: Places, mesh: GearMesh) -> Actor:
    """The line that the circle of a pinion rolls on, over one of its turns."""
    normal, along, radius = mesh.axes[2], mesh.axes[3], float(mesh.pair.r[0])
    middle = -(mesh.pair.distance - radius) * np.cross(along, normal)
    points = middle + np.pi * radius * np.array([[-1.0], [1.0]]) * along
    return lines((points, np.array([[0, 1]])), places.frame(mesh.j), width=LINE_WIDTH)
