"""What gmsh knows of the faces of an open geometry; runs in the child process.

Points and directions are evaluated on the surfaces of the CAD, so that they are exact to round-off
whatever the mesh. The first parameter of all round surfaces is the angle about their axis; the
second of a sphere or torus the angle from its equator. Faces that are picked get a name.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType

import numpy as np

from rom.errors import TagError
from rom.fe.mesh.cad import Axis, Face, Vector
from rom.fe.mesh.picks import EVERY_FACE, Pick, picks
from rom.fe.mesh.solid import MAX_SHOWN, Notes, shown
from rom.fe.mesh.sources.gmsh_groups import elements
from rom.model import Array, Index

KINDS = {kind: kind.lower() for kind in ("Plane", "Cylinder", "Cone", "Sphere", "Torus")}
COAXIAL_RTOL = 1e-6  # of the size, and of the angle between axes
SMALLEST_ARC = 0.499 * np.pi  # of cylinders with an axis of use: a quarter turn, less round-off
MAX_DISTANCE_RATIO = 0.05  # of the diagonal: a point further from every face is a mistake
TIE_RTOL = 1e-6  # of the diagonal: difference in distance of two faces that are equally near
RADIUS_RTOL = 1e-5  # two radii are the same; a list of faces shows six digits
NORMAL_ANGLE = 2e-3  # [rad] two normals are the same; less than the draft of a mould


def surfaces(gmsh: ModuleType) -> list[int]:
    """Numbers of the surfaces that bound a volume, ascending."""
    every = sorted(tag for _, tag in gmsh.model.getEntities(2))
    return [tag for tag in every if len(gmsh.model.getAdjacencies(2, tag)[0])]


def kind_of(gmsh: ModuleType, tag: int) -> str:
    """Kind of a surface, as in `Face`."""
    return KINDS.get(gmsh.model.getType(2, tag), "other")


def faces(gmsh: ModuleType) -> list[Face]:
    """All faces of a meshed part of the OpenCASCADE kernel."""
    names = {
        int(tag): gmsh.model.getPhysicalName(2, group)
        for _, group in gmsh.model.getPhysicalGroups(2)
        for tag in gmsh.model.getEntitiesForPhysicalGroup(2, group)
    }
    cells = {volume: next(elements(gmsh, 3, volume))[2] for _, volume in gmsh.model.getEntities(3)}
    return [_face(gmsh, tag, cells, names.get(tag, "")) for tag in surfaces(gmsh)]


def _face(gmsh: ModuleType, tag: int, cells: dict[int, Index], name: str) -> Face:
    kind = kind_of(gmsh, tag)
    area, middle = gmsh.model.occ.getMass(2, tag), gmsh.model.occ.getCenterOfMass(2, tag)
    found: Notes = {}
    if kind == "plane":
        volume = int(gmsh.model.getAdjacencies(2, tag)[0][0])
        found = {"normal": vector(_outward(gmsh, tag, cells[volume]))}
    elif kind != "other":
        found = _of_revolution(gmsh, tag, kind)
    return Face(tag, kind, float(area), vector(middle), name=name, **found)


def _of_revolution(gmsh: ModuleType, tag: int, kind: str) -> Notes:
    """Radius, axis and point of a round face, as far as its kind has them."""
    if kind in ("cylinder", "cone"):
        ring = _circle(gmsh, tag)
        axis = {"axis": vector(ring.axis)}
        if kind == "cone":
            return axis | {"point": vector(ring.centre)}
        middle = np.mean(_ends(gmsh, tag), axis=0)
        return axis | {"radius": ring.radius, "point": vector(middle)}
    outer = _circle_at(gmsh, tag, 0.0, 0.0)
    point = {"point": vector(outer.centre)}
    if kind == "sphere":
        return point | {"radius": outer.radius}
    radius = 0.5 * (outer.radius - _circle_at(gmsh, tag, 0.0, np.pi).radius)
    return point | {"radius": radius, "axis": vector(outer.axis)}


def axes(gmsh: ModuleType) -> dict[str, Axis]:
    """Axes of the named surfaces that consist of cylinder faces about one line."""
    found: dict[str, Axis] = {}
    for _, group in gmsh.model.getPhysicalGroups(2):
        name = gmsh.model.getPhysicalName(2, group)
        tags = [int(t) for t in gmsh.model.getEntitiesForPhysicalGroup(2, group)]
        if tags and all(kind_of(gmsh, tag) == "cylinder" for tag in tags):
            axis = _common_axis(gmsh, tags)
            found |= {name: axis} if axis else {}
    return found


def _common_axis(gmsh: ModuleType, tags: list[int]) -> Axis | None:
    """None if the faces have several axes, or go around less than a quarter turn."""
    bounds = [gmsh.model.getParametrizationBounds(2, tag) for tag in tags]
    if max(abs(high[0] - low[0]) for low, high in bounds) < SMALLEST_ARC:
        return None
    first = _circle(gmsh, tags[0])
    ends = np.array([end for tag in tags for end in _ends(gmsh, tag)])
    along = (ends - first.centre) @ first.axis
    aside = ends - first.centre - along[:, None] * first.axis
    if np.linalg.norm(aside, axis=1).max() > COAXIAL_RTOL * (np.ptp(along) + first.radius):
        return None
    radii = [_circle(gmsh, tag).radius for tag in tags]
    same = np.ptp(radii) < COAXIAL_RTOL * first.radius
    middle = first.centre + 0.5 * (along.min() + along.max()) * first.axis
    return Axis(vector(middle), vector(first.axis), first.radius if same else None)


@dataclass(frozen=True, slots=True)
class _Circle:
    """Centre (3,), unit axis (3,) and radius of a circle about the axis of a surface."""

    centre: Array
    axis: Array
    radius: float


def _circle(gmsh: ModuleType, tag: int) -> _Circle:
    """The circle half-way along a surface of revolution."""
    u, v = np.mean(gmsh.model.getParametrizationBounds(2, tag), axis=0)
    return _circle_at(gmsh, tag, u, v)


def _circle_at(gmsh: ModuleType, tag: int, u: float, v: float) -> _Circle:
    """Three points of it, which may lie beyond the edges of the face, give it."""
    turns = (0.0, 0.5 * np.pi, np.pi)
    a, b, c = (np.array(gmsh.model.getValue(2, tag, [u + turn, v])) for turn in turns)
    centre = 0.5 * (a + c)
    axis = np.cross(a - centre, b - centre)
    axis *= np.sign(axis[np.argmax(np.abs(axis).round(12))]) / np.linalg.norm(axis)
    return _Circle(centre, axis, float(0.5 * np.linalg.norm(a - c)))


def _ends(gmsh: ModuleType, tag: int) -> tuple[Array, Array]:
    """Points of the axis at both ends of a cylinder face."""
    (u, low), (_, high) = gmsh.model.getParametrizationBounds(2, tag)
    return _circle_at(gmsh, tag, u, low).centre, _circle_at(gmsh, tag, u, high).centre


def _outward(gmsh: ModuleType, tag: int, cells: Index) -> Array:
    """(3,) unit normal of a plane surface, away from those (m, k) of its volume."""
    at = np.mean(gmsh.model.getParametrizationBounds(2, tag), axis=0)
    normal = np.array(gmsh.model.getNormal(tag, list(at)))
    facet = next(elements(gmsh, 2, tag))[2][0]
    near = cells[(cells == facet[0]).any(axis=1)]
    cell = near[np.isin(near, facet).sum(axis=1).argmax()]
    middles = [
        np.mean([gmsh.model.mesh.getNode(int(n))[0] for n in x], axis=0) for x in (facet, cell)
    ]
    return normal if normal @ (middles[0] - middles[1]) > 0 else -normal


def vector(values: Iterable[float]) -> Vector:
    """Three plain numbers, without negative zeros."""
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z


class Picker:
    """Finds faces of a meshed part."""

    def __init__(self, gmsh: ModuleType) -> None:
        self.gmsh = gmsh
        self.surfaces = surfaces(gmsh)

    @cached_property
    def faces(self) -> list[Face]:
        """All faces as the CAD knows them."""
        return faces(self.gmsh)

    def found(self, wish: Pick) -> list[int]:
        """Numbers of the faces a wish picks, at least one."""
        found: list[int] = getattr(self, f"_{wish.kind}")(wish)
        return found

    def _number(self, wish: Pick) -> list[int]:
        number = int(wish.values[0])
        if number not in self.surfaces:
            n = len(self.surfaces)
            raise TagError(
                f"there is no face {number}; the part has {n} faces, numbered "
                f"{self.surfaces[0]} to {self.surfaces[-1]}."
            )
        return [number]

    def _box(self, wish: Pick) -> list[int]:
        inside = self.gmsh.model.getEntitiesInBoundingBox(*wish.values, 2)
        if found := [tag for _, tag in inside if tag in self.surfaces]:
            return found
        raise TagError(f"no face lies inside of the box {wish.text}.", hint="Boxes are in metres.")

    def _point(self, wish: Pick) -> list[int]:
        """The surface nearest to the point, measured to nodes and centres of its facets."""
        distance = {tag: self._distance(tag, wish.values) for tag in self.surfaces}
        order, size = sorted(distance, key=lambda tag: distance[tag]), diagonal(self.gmsh)
        best = distance[order[0]]
        if best > MAX_DISTANCE_RATIO * size:
            whole = all(x > 0 and x.is_integer() for x in wish.values)
            numbers = "+".join(f"{x:g}" for x in wish.values)
            raise TagError(
                f"the nearest face is {best:.3g} m from the point {wish.text}, the body "
                f"{size:.3g} m long.",
                hint="Points are in metres, on or near the face."
                + (f" Faces of these numbers are {numbers!r}." if whole else ""),
            )
        if len(order) > 1 and distance[order[1]] - best < TIE_RTOL * size:
            text = f"faces {order[0]} and {order[1]} are equally near to the point {wish.text}"
            raise TagError(f"{text}; choose a point away from the edge, or a number.")
        return order[:1]

    def _distance(self, tag: int, point: tuple[float, ...]) -> float:
        nodes, x, _ = self.gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)
        nodes, first = np.unique(nodes.astype(np.int64), return_index=True)
        x = x.reshape(-1, 3)[first]
        blocks = elements(self.gmsh, 2, tag)
        centres = [x[np.searchsorted(nodes, rows)].mean(axis=1) for _, _, rows in blocks]
        return float(np.linalg.norm(np.vstack([x, *centres]) - point, axis=1).min())

    def _radius(self, wish: Pick) -> list[int]:
        """All cylinder faces of the radius: of a bore in two halves, both."""
        wanted = wish.values[0]
        known = {f.number: f.radius for f in self.faces if f.kind == "cylinder" and f.radius}
        if found := [n for n, r in known.items() if abs(r - wanted) <= RADIUS_RTOL * wanted]:
            return found
        count = Counter(f"{r:.6g}" for r in known.values())
        near = sorted(count, key=lambda text: abs(float(text) - wanted))
        listed = shown([f"{r} ({count[r]} face{'s' * (count[r] > 1)})" for r in near])
        there = f"The nearest radii are {listed} m." if near else "The part has no cylinder face."
        raise TagError(f"no cylinder face has the radius {wanted:g} m.", hint=there)

    def _normal(self, wish: Pick) -> list[int]:
        """The plane face that looks this way."""
        direction = np.array(wish.values) / np.linalg.norm(wish.values)
        planes = [face for face in self.faces if face.kind == "plane"]
        apart = {f.number: float(np.linalg.norm(np.array(f.normal) - direction)) for f in planes}
        found = [f for f in planes if apart[f.number] < NORMAL_ANGLE]
        if len(found) == 1:
            return [found[0].number]
        text = f"no plane face has the outward normal {wish.text[7:]}."
        near = sorted(planes, key=lambda f: apart[f.number])[:MAX_SHOWN]
        listed = ", ".join(f"{f.number} ({_words(f.normal or ())})" for f in near)
        hint = f"The nearest are {listed}." if near else "The part has no plane face."
        if found:
            joined = "+".join(str(f.number) for f in found[:2])
            listed = shown([f"{f.number} (middle {_words(f.middle)} m)" for f in found])
            text = f"{len(found)} plane faces have the outward normal {wish.text[7:]}: {listed}."
            hint = f"Pick one by its number or by a point on it, or several as {joined}."
        raise TagError(text, hint=hint)


def _words(x: tuple[float, ...]) -> str:
    return ",".join(f"{value:.4g}" for value in x)


def pick(gmsh: ModuleType, wanted: Notes, file: str) -> dict[str, list[int]]:
    """Name the picked faces of a meshed geometry; their numbers, by name.

    Wanted is {name: what `rom.fe.mesh.picks.picks` takes, or `EVERY_FACE`}.
    """
    named: dict[int, str] = {}
    found: dict[str, list[int]] = {}
    picker = Picker(gmsh)
    for name, wishes in wanted.items():
        if wishes == EVERY_FACE:
            continue
        try:
            tags = sorted({tag for wish in picks(wishes) for tag in picker.found(wish)})
        except TagError as error:
            hint = f"{error.told_hint} rom mesh {file} --faces lists the faces.".strip()
            raise TagError(f"face {name!r}: {error.message}", hint=hint) from None
        if both := [tag for tag in tags if tag in named]:
            raise TagError(
                f"face {both[0]} is to be called {named[both[0]]!r} and {name!r}.",
                hint="Pick each face once; an interface may serve several joints.",
            )
        named |= dict.fromkeys(tags, name)
        found[name] = tags
        group(gmsh, name, tags)
    for name in (name for name, wishes in wanted.items() if wishes == EVERY_FACE):
        for tag in surfaces(gmsh):
            if not gmsh.model.getPhysicalGroupsForEntity(2, tag).size:
                group(gmsh, f"{name} {tag}", [tag])
    return found


def group(gmsh: ModuleType, name: str, tags: list[int]) -> None:
    """Give surfaces a name."""
    number = gmsh.model.addPhysicalGroup(2, tags)
    gmsh.model.setPhysicalName(2, number, name)


def diagonal(gmsh: ModuleType) -> float:
    """Of the box around the geometry [m]."""
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    return float(np.linalg.norm(box[3:] - box[:3]))
