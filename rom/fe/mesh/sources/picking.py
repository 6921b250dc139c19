"""Names for the faces that are picked in a STEP file; runs in the child process."""

from collections import Counter
from functools import cached_property
from typing import Any

import numpy as np

from rom.errors import TagError
from rom.fe.mesh.cad import Face
from rom.fe.mesh.picks import EVERY_FACE, Pick, picks
from rom.fe.mesh.solid import MAX_SHOWN, shown
from rom.fe.mesh.sources.cad_faces import faces, surfaces
from rom.fe.mesh.sources.step import diagonal, group
from rom.model import Array

MAX_DISTANCE_RATIO = 0.05  # of the diagonal: a point further from every face is a mistake
TIE_RTOL = 1e-6  # of the diagonal: difference in distance of two faces that are equally near
RADIUS_RTOL = 1e-5  # two radii are the same; a list of faces shows six digits
NORMAL_ANGLE = 2e-3  # [rad] two normals are the same; less than the draft of a mould


class Picker:
    """Finds faces of a meshed part."""

    def __init__(self, gmsh: Any) -> None:
        self.gmsh = gmsh
        self.surfaces = surfaces(gmsh)

    @cached_property
    def faces(self) -> list[Face]:
        """All faces as the CAD knows them."""
        return faces(self.gmsh)

    def found(self, wish: Pick) -> list[int]:
        """Numbers of the faces a wish picks, at least one.

        Raises:
            TagError: if there is none, or not one alone where one is meant.
        """
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
            raise TagError(
                f"faces {order[0]} and {order[1]} are equally near to the point {wish.text}.",
                hint="Choose a point away from the edge, or a number.",
            )
        return order[:1]

    def _distance(self, tag: int, point: tuple[float, ...]) -> float:
        mesh = self.gmsh.model.mesh
        nodes, x, _ = mesh.getNodes(2, tag, includeBoundary=True)
        x, order = x.reshape(-1, 3), np.argsort(nodes)
        centres = []
        for kind, _, corners in zip(*mesh.getElements(2, tag), strict=True):
            size = mesh.getElementProperties(kind)[3]
            rows = order[np.searchsorted(nodes, corners, sorter=order)].reshape(-1, size)
            centres.append(x[rows].mean(axis=1))
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
        angle = {f.number: _angle(np.array(f.normal), direction) for f in planes}
        found = [f for f in planes if angle[f.number] < NORMAL_ANGLE]
        if len(found) == 1:
            return [found[0].number]
        if found:
            joined = "+".join(str(f.number) for f in found[:2])
            listed = shown([f"{f.number} (middle {_words(f.middle)} m)" for f in found])
            raise TagError(
                f"{len(found)} plane faces have the outward normal {wish.text[7:]}: {listed}.",
                hint=f"Pick one by its number or by a point on it, or several as {joined}.",
            )
        near = sorted(planes, key=lambda f: angle[f.number])[:MAX_SHOWN]
        listed = ", ".join(f"{f.number} ({_words(f.normal or ())})" for f in near)
        there = f"The nearest are {listed}." if near else "The part has no plane face."
        raise TagError(f"no plane face has the outward normal {wish.text[7:]}.", hint=there)


def _angle(a: Array, b: Array) -> float:
    """Angle between unit vectors [rad]."""
    return float(2 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b)))


def _words(x: tuple[float, ...]) -> str:
    return ",".join(f"{value:.4g}" for value in x)


def pick(gmsh: Any, wanted: dict[str, Any], file: str) -> dict[str, list[int]]:
    """Name the picked faces of a meshed geometry.

    Args:
        gmsh: the module, with the meshed part.
        wanted: {name: what `rom.fe.mesh.picks.picks` takes, or `EVERY_FACE`}.
        file: name of the file, for messages.

    Returns:
        Numbers of the faces that were picked, by name.

    Raises:
        TagError: nothing, or two faces, at the place given; two names for one face.
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
    for name, wishes in wanted.items():
        if wishes == EVERY_FACE:
            _number(gmsh, name)
    return found


def _number(gmsh: Any, name: str) -> None:
    for tag in surfaces(gmsh):
        if not gmsh.model.getPhysicalGroupsForEntity(2, tag).size:
            group(gmsh, f"{name} {tag}", [tag])
