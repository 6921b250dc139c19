"""Gears on oil films as they bear: toothed shafts, and walls as high as the loads on them."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import AnyMechanism, AnySolution, Positive, typed, unit_vector
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.components.gear_mesh.gears.meshes import GearMesh, middle_of_tooth
from rom.components.gear_mesh.gears.racks import RackPair
from rom.components.gear_mesh.tooth_loads import ToothLoads, tooth_loads
from rom.components.journal_bearing.record import film_pressures
from rom.errors import ConfigError
from rom.model import Array
from rom.names import check_known
from rom.view.canvas.solids import Mesh, cylinder, gear, joined
from rom.view.scenes.places import Places, at_start, moving

Axes = tuple[Array, Array, Array]  # (3,) along the line of centres, across it, along the shafts


@typed
def toothed_shaft(mechanism: AnyMechanism, body: str) -> Mesh:
    """A shaft with the wheels of its gear meshes, where it was added: teeth stand in each other.

    Teeth have the height of a standard profile, without shifts and thinning. The body turns in
    journal bearings, which say how thick it is; its surface, or else its markers, say how long.

    Returns:
        Points (n, 3) in the world [m] and triangles (m, 3).

    Raises:
        ConfigError: for a body without journal bearings, or with helical or internal wheels.
    """
    places = at_start(mechanism)
    films = [film for film in mechanism.journal_bearings.values() if film.i.body == body]
    turning = {film.i.body for film in mechanism.journal_bearings.values()}
    check_known(body, turning, f"{body!r} turns in no journal bearing; there are")
    axis = places.direction(body, films[0].axes[0])[0]
    middle, part = places.point(films[0].i)[0], mechanism.part(body)
    surface = getattr(part.flexible, "surface", None)
    X = [part.point(part.marker(name)) for name in part.names]
    X = X if surface is None else surface.points
    (r,), (A,) = places.pose(body)
    along = (r + np.asarray(X) @ A.T - middle) @ axis
    start, end = (middle + x * axis for x in (along.min(), along.max()))
    diameter = 2 * max(film.bearing.radius for film in films)
    return joined([cylinder(start, end, diameter), *_wheels(places, body)])


def _wheels(places: Places, body: str) -> Iterator[Mesh]:
    """Of all meshes of a body."""
    for name, mesh in places.mechanism.gear_meshes.items():
        for side, marker in enumerate((mesh.i, mesh.j)):
            if marker.body != body or not mesh.pair.teeth[side]:
                continue
            pair = mesh.pair
            if getattr(pair, "helix", 0.0) or min(pair.teeth) < 0:
                raise ConfigError(f"the wheels of {name!r} must be spur wheels with teeth outside.")
            axes = _axes(places, mesh)
            z, m, alpha = int(pair.teeth[side]), pair.module, pair.pressure_angle
            points, triangles = gear(z, m, pair.width, pressure_angle=alpha)
            turn = side * np.pi + middle_of_tooth(pair, side, mesh.phase) - np.pi / z
            c, s = np.cos(turn), np.sin(turn)
            rows = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ np.array(axes)
            yield points @ rows + places.point(marker)[0], triangles


def _axes(places: Places, mesh: GearMesh) -> Axes:
    """From the pinion to the gear, across, and along the pinion, in the world."""
    z = places.direction(mesh.i.body, mesh.axes[0])[0]
    D = places.point(mesh.j)[0] - places.point(mesh.i)[0]
    right = np.sign(mesh.pair.distance) * (D - (D @ z) * z)
    right /= np.linalg.norm(right)
    return right, np.cross(z, right), z


@typed
def tooth_walls(
    solution: AnySolution,
    name: str,
    *,
    scale: Annotated[float, Positive("m^2/N")],
    direction: npt.ArrayLike,
    at: int = -1,
) -> Mesh:
    """Walls on the lines where teeth touch, as high as their load.

    Args:
        solution: a motion; of an equilibrium after `rom.mbs.snapshot`.
        name: of the gear mesh.
        scale: height over load per length of line [m^2/N].
        direction: (3,) in which the walls stand, in the world [1].
        at: number of the instant.

    Returns:
        Points (n, 3) in the world [m] and triangles (m, 3).

    Raises:
        ConfigError: if there is no such mesh, or no tooth of it bears.
    """
    upright = unit_vector("direction", direction)
    loads = tooth_loads(solution, name)[at]
    if not loads.force.any():
        raise ConfigError(f"no tooth of {name!r} bears at that instant; take another one of sol.t.")
    mesh = solution.mechanism.gear_meshes[name]
    places = moving(solution.mechanism, solution, np.array([at]), 1.0)
    axes, middle = _axes(places, mesh), places.point(mesh.i)[0]
    lines = _lines(mesh.pair, loads, axes)
    points, triangles = joined([_wall(line, scale * load, upright) for line, load in lines])
    return points + middle, triangles


def _lines(
    pair: GearPair | RackPair, loads: ToothLoads, axes: Axes
) -> Iterator[tuple[Array, Array]]:
    """Places (k, 3) from the middle of the pinion and load per length (k,) of each line."""
    right, across, z = axes
    c, s = np.cos(pair.alpha), np.sin(pair.alpha)
    begin = loads.place - np.tan(pair.base_helix) * loads.height  # of its line
    apart = np.abs(np.diff(begin)) > 0.5 * pair.base_pitch
    first = np.flatnonzero(apart | (np.diff(loads.back.astype(int)) != 0)) + 1
    for line in np.split(np.arange(loads.place.size), first):
        side = -across if loads.back[line[0]] else across
        path = np.outer(loads.place[line], s * right + c * side)
        points = pair.rb[0] * (c * right - s * side) + path + np.outer(loads.height[line], z)
        along = points[-1] - points[0] if line.size > 1 else z
        half = 0.5 * loads.length[line[[0, -1]], None] * along / np.linalg.norm(along)
        load = loads.force[line] / loads.length[line]
        yield (
            np.vstack([points[:1] - half[:1], points, points[-1:] + half[1:]]),
            load[[0, *range(line.size), -1]],
        )


@typed
def film_wall(
    solution: AnySolution,
    name: str,
    *,
    scale: Annotated[float, Positive("m/Pa")],
    gap: float = 0.0,
    shift: float = 0.0,
    at: int = -1,
) -> Mesh:
    """A wall around a journal, outwards as high as the pressure of the oil in the middle.

    Args:
        solution: a motion; of an equilibrium after `rom.mbs.snapshot`.
        name: of the journal bearing.
        scale: height over pressure [m/Pa].
        gap: by which the wall stands outside the bore [m].
        shift: by which it stands ahead of the middle of the bush, along the axis of the bearing
            [m].
        at: number of the instant.

    Returns:
        Points (n, 3) in the world [m] and triangles (m, 3).

    Raises:
        ConfigError: if there is no such bearing, or its film is read from a table.
    """
    pressure = film_pressures(solution, name)[at]
    film = solution.mechanism.journal_bearings[name]
    places = moving(solution.mechanism, solution, np.array([at]), 1.0)
    z, x = (places.direction(film.j.body, axis)[0] for axis in film.axes[1:])
    middle = places.point(film.j)[0] + shift * z
    nt, nz = pressure.shape
    around = pressure[:, 0 if film.bearing.aligned else nz // 2]
    angle = 2 * np.pi * np.arange(nt + 1)[:, None] / nt
    outwards = np.cos(angle) * x + np.sin(angle) * np.cross(z, x)
    line = middle + (film.bearing.radius + gap) * outwards
    return _wall(line, scale * np.append(around, around[0]), outwards)


def _wall(line: Array, heights: Array, direction: Array) -> Mesh:
    """On a line (k, 3) with heights (k,) [m] along a direction (3,) or (k, 3) [1]."""
    k = len(line)
    i = np.arange(k - 1)
    lower, upper = np.column_stack([i, i + 1, i + k]), np.column_stack([i + 1, i + k + 1, i + k])
    return np.vstack([line, line + heights[:, None] * direction]), np.vstack([lower, upper])
