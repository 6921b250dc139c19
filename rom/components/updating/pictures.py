"""Pictures of a vibration test: where its points are on the body, and along which directions."""

from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from rom import view
from rom.body.surface import surface_of
from rom.components.updating.family_model import Family, Parts
from rom.components.updating.measured import Channels, Responses
from rom.model import Array, Index
from rom.names import check_ending


def match(family: Family, test: Responses, path: Path) -> None:
    """Draw where the points of a test are, also of one that does not belong to the body."""
    check_ending(path, "a picture", ".png")
    points = np.vstack([test.sensors.points, test.inputs.points])
    far = cKDTree(_surface(family)[0]).query(points)[0].max()
    more = f"Largest distance of the {len(points)} points from one of the surface: {far:.3g} m."
    drawn(family, (test.sensors, test.inputs), path, "Points of a vibration test", more)


def drawn(
    family: Family, channels: tuple[Channels, Channels], path: Path, title: str, more: str
) -> None:
    """A picture of the body with its channels, from two sides."""
    pairs = zip(("sensors", "forces"), channels, strict=True)
    several = {name: (one.points, one.directions) for name, one in pairs}
    sides = ("the front and above", -1.0, 1.0), ("behind and below", 1.0, -1.0)
    seen = partial(view.channels, _surface(family), several, up=(0, 0, 1))
    scenes = [seen(title=f"Seen from {side}", view=(0.6 * y, y, 0.7 * z)) for side, y, z in sides]
    text = "A ball marks a point, its pin the direction, in the axes of the geometry; a point may"
    view.plane(scenes, path, title=title, caption=f"{text} carry several. {more}")


def _surface(family: Family) -> tuple[Array, Index]:
    """Points (n, 3) [m] and triangles of all bodies together."""
    surfaces = [surface_of(body) for body in Parts.of(family).bodies.values()]
    return view.joined([(surface.points, surface.triangles) for surface in surfaces])
