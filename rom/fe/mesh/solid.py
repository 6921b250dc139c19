"""The record of a solid mesh: plain NumPy arrays, on one process."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NotRequired, TypedDict

import numpy as np
import numpy.typing as npt

from rom.errors import ConfigError, FileFormatError, MeshError, in_file
from rom.fe.mesh.cad import Axis, Face
from rom.fe.mesh.cell_types import READ_TYPES, CellType
from rom.model import Array, Attachment, Index, Integers, Mask, Material
from rom.names import named

MAX_SHOWN = 5  # culprits named in a message
GEOMETRIES = ("geo", "builder", "step")  # readers that make a mesh
PROGRAMS = ("builder",)  # can do what a user can: run only with trust, and then without limits
Arrays = dict[str, npt.NDArray[Any]]
Notes = dict[str, Any]  # what fits into JSON, by name
Read = tuple[Arrays, Notes]
Made = tuple[Notes, Notes]  # parameters used, defaults of some of them


@dataclass(frozen=True, slots=True)
class Tie:
    """Nodes that a deck ties to a reference node, or one that it loads with a mass."""

    points: Array  # (k, 3) of the nodes [m]
    weights: Array  # (k,) in a mean motion; none where the surface of the same name weighs
    origin: Array  # (3,) of the reference node [m]
    kind: str  # of interface: "rbe2", "rbe3", or "" for one node


@dataclass(frozen=True, slots=True)
class Spring:
    """Stiffness between two ties of a deck."""

    name: str
    ends: tuple[str, str]
    stiffness: Array  # (12, 12) of both, displacements and rotations at their origins


@dataclass(frozen=True, slots=True)
class SolidMesh:
    """A solid body cut into cells of one type."""

    points: Array  # (n, 3) node coordinates [m]
    cells: Index  # (m, k) node numbers in gmsh order
    cell_type: str  # "tet4", "tet10", "hex8" or "hex27"
    regions: Index  # (m,) region number of each cell
    region_names: dict[int, str]  # name of each region number
    # (f, kf) node numbers in gmsh order of the facets of each named surface; a facet may belong to
    # several surfaces
    facets: dict[str, Index]
    # where the mesh comes from: path, sha256, parameters, versions
    provenance: Notes = field(default_factory=dict)
    # (m,) numbers of the cells in the file, for messages; None for 0, 1, 2, ..
    cell_ids: Index | None = None
    # what `rom.fe.mesh.validate.validate` found worth saying; None before it was asked
    warnings: tuple[str, ...] | None = None
    # axis of each named surface that the CAD knows as cylinder faces about one line
    axes: dict[str, Axis] = field(default_factory=dict)
    # E [Pa], nu [1] and rho [kg/m^3] of regions by name, as a deck says, or why that is not read
    materials: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    unread: Notes = field(default_factory=dict)
    ties: dict[str, Tie] = field(default_factory=dict)  # of a deck, by name
    carried: tuple[Attachment, ...] = ()  # masses of a deck, on surfaces and ties
    springs: tuple[Spring, ...] = ()  # of a deck, between ties
    faces: tuple[Face, ...] = ()  # all faces of the CAD, where they were asked for

    @property
    def kind(self) -> CellType:
        """Node order, faces and shape functions of the cells."""
        return READ_TYPES[self.cell_type]

    @property
    def size(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def solids(self) -> dict[str, Material]:
        """{region: material} as the deck says; raises what keeps them from being read."""
        path = str(self.provenance.get("path", ""))
        if self.unread:
            raise FileFormatError(**self.unread | {"where": self.unread.get("where") or path})
        if missing := sorted(set(self.region_names.values()) - self.materials.keys()):
            text = f"the file says no material of the region {named(missing)}"
            raise ConfigError(
                f"{text}; give material=, on the command line --material.", where=path
            )
        with in_file(path):  # the same numbers are one material
            made = {row: Material(*row) for row in set(self.materials.values())}
        return {name: made[row] for name, row in self.materials.items()}

    @property
    def corners(self) -> Index:
        """(m, c) corner nodes of the cells."""
        return self.cells[:, : self.kind.n_corners]


def compact(mesh: SolidMesh) -> SolidMesh:
    """Without nodes that belong to no cell; facets keep theirs, to be found by the checks."""
    used = np.zeros(mesh.points.shape[0], dtype=bool)
    for rows in (mesh.cells, *mesh.facets.values()):
        used[rows] = True
    if used.all():
        return mesh
    new = np.cumsum(used) - 1
    facets = {name: new[rows] for name, rows in mesh.facets.items()}
    return replace(mesh, points=mesh.points[used], cells=new[mesh.cells], facets=facets)


def cell_names(mesh: SolidMesh, cells: Index) -> str:
    """The numbers of the first few of some cells in their file, for messages."""
    return shown(cells if mesh.cell_ids is None else mesh.cell_ids[cells])


def shown(some: Sequence[object] | Index) -> str:
    """The first few of some things, for messages."""
    return ", ".join(map(str, some[:MAX_SHOWN])) + (", ..." if len(some) > MAX_SHOWN else "")


def refuse_cells(mesh: SolidMesh, bad: Mask, what: str, hint: str = "") -> None:
    """Raise a MeshError when any cell is bad: how many, what is wrong, and the first few."""
    cells = np.flatnonzero(bad)
    if cells.size:
        raise MeshError(f"{cells.size} {what}: cells {cell_names(mesh, cells)}.", hint=hint)


class Request(TypedDict):
    """What is asked of a reader, in what fits into JSON."""

    path: str
    reader: str
    parameters: Notes
    faces: Notes
    order: int | None
    flat: NotRequired[bool]  # triangles of a plane section
    folder: NotRequired[str]  # of the process that reads


def packed(
    points: Array,
    cells: Integers,
    cell_type: str,
    regions: Integers,
    cell_ids: Integers,
    **notes: Any,
) -> Read:
    """Arrays "points", "cells", "regions", "cell_ids", "facets 0", ..., and notes on them.

    Given are ``facets``, ``region_names``, ``warnings`` and mostly ``provenance`` as notes; noted
    are the names of facets, in their order, and the type of the cells.
    """
    facets = notes.pop("facets")
    arrays: Arrays = {
        "points": np.asarray(points, dtype=float),
        "cells": np.asarray(cells, dtype=np.int64),
        "regions": np.asarray(regions, dtype=np.int64),
        "cell_ids": np.asarray(cell_ids, dtype=np.int64),
    }
    for i, rows in enumerate(facets.values()):
        arrays[f"facets {i}"] = np.asarray(rows, dtype=np.int64)
    return arrays, notes | {"cell_type": cell_type, "facet_names": list(facets)}
