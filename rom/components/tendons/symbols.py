"""How tendons are drawn."""

from collections.abc import Iterator

import numpy as np

from rom.components.tendons.paths import Place, path_through, points_along
from rom.components.tendons.tendons import Tendon
from rom.mbs.parts.bodies import Marker
from rom.model import Array
from rom.view.canvas.scene import Actor
from rom.view.scenes.connections import DAMPER_COLOUR, LINE_WIDTH
from rom.view.scenes.ground import Scenery

Drawn = Actor | tuple[Marker, Array, float]  # or axis and radius of a circle at a marker


def draw(scenery: Scenery, name: str, tendon: Tendon) -> Iterator[Drawn]:
    """The line of a cable, and the circles of its pulleys."""
    places, stations = scenery.places, tendon.stations
    x = [places.point(one.marker) for one in stations]
    turned = [places.pose(one.marker.body)[1] for one in stations]
    drawn = []
    for f in range(max(map(len, x))):
        found = [
            Place(x[k][f % len(x[k])], one.axes @ turned[k][f % len(turned[k])].T, one.radius)
            for k, one in enumerate(stations)
        ]
        drawn.append(points_along(path_through(name, found), found))
    points = np.array(drawn)
    n = points.shape[1]
    cells = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    yield Actor(points, cells, colour=DAMPER_COLOUR, width=LINE_WIDTH)
    for one in stations:
        if one.radius:
            yield one.marker, one.axes[0], one.radius
