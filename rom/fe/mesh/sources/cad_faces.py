"""What gmsh knows of the faces of an open geometry; runs in the child process.

Points and directions are evaluated on the surfaces of the CAD, so that they are exact to round-off
whatever the mesh. The first parameter of all round surfaces is the angle about their axis; the
second of a sphere or torus the angle from its equator.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.fe.mesh.cad import Axis, Face, Vector
from rom.model import Array

KINDS = {
    "Plane": "plane",
    "Cylinder": "cylinder",
    "Cone": "cone",
    "Sphere": "sphere",
    "Torus": "torus",
}
COAXIAL_RTOL = 1e-6  # of the size, and of the angle between axes
SMALLEST_ARC = 0.499 * np.pi  # of cylinders with an axis of use: a quarter turn, less round-off


def surfaces(gmsh: Any) -> list[int]:
    """Numbers of the surfaces that bound a volume, ascending."""
    every = sorted(tag for _, tag in gmsh.model.getEntities(2))
    return [tag for tag in every if len(gmsh.model.getAdjacencies(2, tag)[0])]


def kind_of(gmsh: Any, tag: int) -> str:
    """Kind of a surface, as in `Face`."""
    return KINDS.get(gmsh.model.getType(2, tag), "other")


def faces(gmsh: Any) -> list[Face]:
    """All faces of a meshed part of the OpenCASCADE kernel."""
    names = {
        int(tag): gmsh.model.getPhysicalName(2, group)
        for _, group in gmsh.model.getPhysicalGroups(2)
        for tag in gmsh.model.getEntitiesForPhysicalGroup(2, group)
    }
    outward = _Outward(gmsh)
    return [_face(gmsh, tag, outward, names.get(tag, "")) for tag in surfaces(gmsh)]


def _face(gmsh: Any, tag: int, outward: "_Outward", name: str) -> Face:
    kind = kind_of(gmsh, tag)
    area, middle = gmsh.model.occ.getMass(2, tag), gmsh.model.occ.getCenterOfMass(2, tag)
    found: dict[str, Any] = SHAPES[kind](gmsh, tag) if kind in SHAPES else {}
    if kind == "plane":
        found = {"normal": vector(outward.normal(tag))}
    return Face(tag, kind, float(area), vector(middle), name=name, **found)


def _cylinder(gmsh: Any, tag: int) -> dict[str, Any]:
    ring = _circle(gmsh, tag)
    point = np.mean(_ends(gmsh, tag), axis=0)
    return {"radius": ring.radius, "axis": vector(ring.axis), "point": vector(point)}


def _cone(gmsh: Any, tag: int) -> dict[str, Any]:
    ring = _circle(gmsh, tag)
    return {"axis": vector(ring.axis), "point": vector(ring.centre)}


def _sphere(gmsh: Any, tag: int) -> dict[str, Any]:
    equator = _circle_at(gmsh, tag, 0.0, 0.0)
    return {"radius": equator.radius, "point": vector(equator.centre)}


def _torus(gmsh: Any, tag: int) -> dict[str, Any]:
    outer, inner = _circle_at(gmsh, tag, 0.0, 0.0), _circle_at(gmsh, tag, 0.0, np.pi)
    radius = 0.5 * (outer.radius - inner.radius)
    return {"radius": radius, "axis": vector(outer.axis), "point": vector(outer.centre)}


SHAPES = {"cylinder": _cylinder, "cone": _cone, "sphere": _sphere, "torus": _torus}


def axes(gmsh: Any) -> dict[str, Axis]:
    """Axes of the named surfaces that consist of cylinder faces about one line."""
    found: dict[str, Axis] = {}
    for _, group in gmsh.model.getPhysicalGroups(2):
        name = gmsh.model.getPhysicalName(2, group)
        tags = [int(t) for t in gmsh.model.getEntitiesForPhysicalGroup(2, group)]
        if tags and all(kind_of(gmsh, tag) == "cylinder" for tag in tags):
            axis = _common_axis(gmsh, tags)
            found |= {name: axis} if axis else {}
    return found


def _common_axis(gmsh: Any, tags: list[int]) -> Axis | None:
    """None if the faces have several axes, or go around less than a quarter turn."""
    if max(map(lambda tag: _arc(gmsh, tag), tags)) < SMALLEST_ARC:
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


def _circle(gmsh: Any, tag: int) -> _Circle:
    """The circle half-way along a surface of revolution."""
    u, v = np.mean(gmsh.model.getParametrizationBounds(2, tag), axis=0)
    return _circle_at(gmsh, tag, u, v)


def _circle_at(gmsh: Any, tag: int, u: float, v: float) -> _Circle:
    """Three points of it, which may lie beyond the edges of the face, give it."""
    a, b, c = (_point(gmsh, tag, u + turn, v) for turn in (0.0, 0.5 * np.pi, np.pi))
    centre = 0.5 * (a + c)
    axis = np.cross(a - centre, b - centre)
    axis *= np.sign(axis[np.argmax(np.abs(axis).round(12))]) / np.linalg.norm(axis)
    return _Circle(centre, axis, float(0.5 * np.linalg.norm(a - c)))


def _ends(gmsh: Any, tag: int) -> tuple[Array, Array]:
    """Points of the axis at both ends of a cylinder face."""
    (u, low), (_, high) = gmsh.model.getParametrizationBounds(2, tag)
    return _circle_at(gmsh, tag, u, low).centre, _circle_at(gmsh, tag, u, high).centre


def _arc(gmsh: Any, tag: int) -> float:
    """Angle that a cylinder face goes around [rad]."""
    (low, _), (high, _) = gmsh.model.getParametrizationBounds(2, tag)
    return abs(high - low)


def _point(gmsh: Any, tag: int, u: float, v: float) -> Array:
    return np.array(gmsh.model.getValue(2, tag, [u, v]))


class _Outward:
    """Normals that point out of the meshed solid."""

    def __init__(self, gmsh: Any) -> None:
        self.gmsh = gmsh
        self.cells: dict[int, Any] = {}  # corner nodes of the cells, by volume

    def normal(self, tag: int) -> Array:
        """(3,) unit normal of a plane surface."""
        gmsh = self.gmsh
        at = np.mean(gmsh.model.getParametrizationBounds(2, tag), axis=0)
        normal = np.array(gmsh.model.getNormal(tag, list(at)))
        corner, inside = self._beside(tag)
        return normal if normal @ (corner - inside) > 0 else -normal

    def _beside(self, tag: int) -> tuple[Array, Array]:
        """A corner of a facet, and the corner of its cell that is not on the facet."""
        facet = _corners(self.gmsh, 2, tag)[0]
        volume = int(self.gmsh.model.getAdjacencies(2, tag)[0][0])
        if volume not in self.cells:
            self.cells[volume] = _corners(self.gmsh, 3, volume)
        cells = self.cells[volume]
        near = cells[(cells == facet[0]).any(axis=1)]
        cell = near[np.isin(near, facet).sum(axis=1).argmax()]
        nodes = facet[0], cell[~np.isin(cell, facet)][0]
        corner, inside = (np.array(self.gmsh.model.mesh.getNode(int(n))[0]) for n in nodes)
        return corner, inside


def _corners(gmsh: Any, dim: int, tag: int) -> Any:
    """(m, c) corner nodes of the elements of an entity."""
    kinds, _, nodes = gmsh.model.mesh.getElements(dim, tag)
    *_, n_nodes, _, n_corners = gmsh.model.mesh.getElementProperties(kinds[0])
    return nodes[0].reshape(-1, n_nodes)[:, :n_corners]


def vector(values: Any) -> Vector:
    """Three plain numbers, without negative zeros."""
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z
