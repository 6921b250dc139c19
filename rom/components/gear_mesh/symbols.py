"""How gear meshes are drawn."""

from collections.abc import Iterator

import numpy as np

from rom.components.gear_mesh.gears.meshes import GearMesh
from rom.mbs.parts.bodies import Marker
from rom.model import Array
from rom.view.canvas.scene import Actor
from rom.view.scenes.connections import LINE_WIDTH
from rom.view.scenes.ground import Scenery, lines


def draw(scenery: Scenery, _: str, mesh: GearMesh) -> Iterator[Actor | tuple[Marker, Array, float]]:
    """The circles that roll on each other, and the line of a rack."""
    yield from zip((mesh.i, mesh.j), mesh.axes[::2], map(float, mesh.pair.r), strict=False)
    if not mesh.pair.teeth[1]:  # over one turn of the pinion
        normal, along, radius = mesh.axes[2], mesh.axes[3], float(mesh.pair.r[0])
        middle = -(mesh.pair.distance - radius) * np.cross(along, normal)
        line = middle + np.pi * radius * np.array([[-1.0], [1.0]]) * along, np.array([[0, 1]])
        yield lines(line, scenery.places.frame(mesh.j), width=LINE_WIDTH)
