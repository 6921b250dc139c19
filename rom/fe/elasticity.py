"""Stiffness and mass of a three-dimensional elastic body on a dolfinx mesh."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

from rom.arguments import typed
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, MeshError, TagError, warn
from rom.fe.compat import assemble_matrix, cell_name, geometry_degree, lagrange, versions
from rom.fe.costs import LEAST_SHARED_DOFS, reduction_seconds
from rom.fe.forms.material import by_region, coefficients, described, doubts
from rom.fe.forms.nodes import all_points, interface, outer_surface
from rom.fe.forms.region import Regions, forms
from rom.fe.forms.stress import Stresses
from rom.fe.jit import compiling
from rom.fe.mesh.cad import Axis
from rom.fe.mesh.curving import without_middles
from rom.fe.mesh.solid import SolidMesh
from rom.fe.operators.aij import symmetric, without_zeros, wrapped
from rom.fe.operators.foreseen import automatic
from rom.fe.operators.memory import give_back
from rom.fe.operators.petsc import PETScOperators
from rom.fe.operators.solver import DIRECT_SOLVER, parsed
from rom.fe.parallel import collective, install_abort_hook, on_root
from rom.model import Attachment, FEModel, Index, Interface, Material, Orthotropic

log = logging.getLogger("rom")
WHOLE_REGION = "solid"  # name of the only region of a mesh without named regions
DEGREES = (1, 2, 3)
SOME_COORDINATES, SOME_MODES = 12, 20  # of two stiff interfaces, for the time of a small model


@typed
def model(
    path: str | Path,
    *,
    material: Material | Orthotropic | Mapping[str, Material | Orthotropic],
    degree: int = 2,
    parameters: dict[str, float] | None = None,
    attachments: Sequence[Attachment] = (),
    solver: str = "auto",
    comm: MPI.Comm = MPI.COMM_WORLD,
    **mesh_options: Any,
) -> FEModel:
    """Finite element model of the solid in a geometry or mesh file.

    Args:
        path: ``.geo``, ``.py``, ``.step``, ``.msh``, ``.inp`` or ``.bdf``, see
            `rom.fe.mesh.read.read_mesh`.
        material: `Material`, `Orthotropic`, or {region name: material}.
        degree: polynomial degree of the displacement, 1 to 3; 2 unless you know better.
        parameters: {name: value} of the geometry's parameters, in the units of the geometry.
        attachments: point masses and rigid bodies carried by interfaces.
        solver: how equations are solved. "auto": the first of "direct", "out-of-core" and
            "iterative" that fits into memory, named in ``provenance["solver"]``; "direct": a
            MUMPS factor, the fastest when it fits; "low-rank" or "low-rank:1e-8": the same with
            compressed blocks; "out-of-core": the factor on disk; "low-rank+out-of-core";
            "iterative": multigrid, with little memory; that no mode is missed is then shown by
            random loads, with the probability in ``provenance["stages"]``.
        comm: the ranks that share the model.
        mesh_options: ``scale``, ``faces``, ``order``, ``trust``, ``time_limit`` and
            ``memory_limit`` of `rom.fe.mesh.read.read_mesh`. Cells are curved where the geometry
            is; straight with ``order=1`` or ``degree=1``.

    Returns:
        FEModel, free-free. On one process K and M are SciPy matrices, under mpirun PETSc
        matrices; ``operators`` are those of PETSc on both.

    Raises:
        ConfigError, FileFormatError, MeshError, TagError: for a file that is no valid solid, or
            an unknown solver.
        UnsafeFileError: for a geometry that would do more than make a mesh, or is Python without
            ``trust``.
        ResourceError: if meshing exceeds its limit of time or memory, or no way to solve would
            fit.
        MaterialError: if a region has no material or a material no region.
        InterfaceError: if an interface is empty or an attachment hangs on none.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)  # 1 m x 50 mm x 30 mm
        >>> beam.interface_names
        ('root', 'tip')
    """
    from rom.fe.mesh.read import is_geometry, read_mesh, to_dolfinx

    method = parsed(solver)  # before a mesh is made in vain
    install_abort_hook(comm)  # whatever a script does next, one failing rank must end all
    read: list[SolidMesh] = []  # on rank 0; the others never hold the whole mesh

    def head() -> tuple[dict[int, str], list[str], dict[str, Any], dict[str, Axis]]:
        if degree == 1 and mesh_options.get("order") is None and is_geometry(path):
            mesh_options["order"] = 1
        read.append(without_middles(read_mesh(path, parameters=parameters, **mesh_options)))
        mesh = read[0]
        return mesh.region_names, list(mesh.warnings or ()), mesh.provenance, mesh.axes

    region_names, warnings, origin, axes = on_root(comm, head)
    with compiling(comm):
        mesh, cell_tags, facet_tags = to_dolfinx(read.pop() if read else None, comm)
    made = assemble(
        mesh,
        cell_tags,
        facet_tags,
        material=material,
        degree=degree,
        regions={name: tag for tag, name in region_names.items()},
        attachments=attachments,
    )
    remarks = [*warnings, *made.provenance["warnings"]]
    _advise(comm, made.n_dofs)
    how, why = automatic(made.operators) if method.automatic else (method, solver)
    if comm.rank == 0 and how != DIRECT_SOLVER and method.automatic:
        log.info("solved %s", why)
    provenance = origin | made.provenance | {"warnings": remarks, "solver": why}
    return replace(
        made,
        operators=made.operators.solved_by(how),
        provenance=provenance,
        interfaces={key: _on_axis(x, axes.get(key)) for key, x in made.interfaces.items()},
    )


def _advise(comm: MPI.Comm, n: int) -> None:
    """Say where a model is too small to be shared."""
    if comm.rank == 0 and comm.size > 1 and n < LEAST_SHARED_DOFS:
        seconds = reduction_seconds(n, SOME_COORDINATES, SOME_MODES)
        log.warning(
            f"{n} dofs are shared by {comm.size} processes; below {LEAST_SHARED_DOFS} one process "
            f"is faster, and reduces them to {SOME_COORDINATES} interface coordinates and "
            f"{SOME_MODES} modes in about {max(seconds, 0.1):.1f} s."
        )


def _on_axis(interface: Interface, axis: Axis | None) -> Interface:
    """The interface with its origin and axis from the CAD where that knows them."""
    if axis is None:
        return interface
    return replace(interface, origin=np.array(axis.point), axis=np.array(axis.direction))


@typed
def assemble(
    mesh: Any,
    cell_tags: Any = None,
    facet_tags: dict[str, Any] | None = None,
    *,
    material: Material | Orthotropic | Mapping[str, Material | Orthotropic],
    degree: int = 2,
    regions: dict[str, int] | None = None,
    attachments: Sequence[Attachment] = (),
) -> FEModel:
    """Finite element model on a dolfinx mesh.

    Args:
        mesh: tetrahedra or hexahedra with straight or quadratic edges, coordinates in m.
        cell_tags: MeshTags of the regions; needed when there are several.
        facet_tags: {interface name: MeshTags of its facets}; groups may share facets.
        material: `Material`, `Orthotropic`, or {region name: material}.
        degree: polynomial degree of the displacement, 1 to 3.
        regions: {region name: tag}; one region called "solid" when not given.
        attachments: point masses and rigid bodies carried by interfaces.

    Returns:
        FEModel, free-free; see `model`.

    Raises:
        ConfigError, MeshError, TagError, MaterialError, InterfaceError: see `model`.
    """
    regions, facet_tags = dict(regions or {WHOLE_REGION: 0}), dict(facet_tags or {})
    shared = mesh.comm.size > 1
    name = _check_mesh(mesh, degree)
    solids = by_region(material, regions)
    _check_attachments(attachments, facet_tags)
    with collective(mesh.comm):
        tags = _cell_regions(mesh, cell_tags, regions)
    with compiling(mesh.comm):
        V = lagrange(mesh, degree)
        points = all_points(V)
        numbers = coefficients(mesh, tags, solids)
        stiffness, mass = forms(V, numbers, degree)
        # the mass first: a third of it is kept, and less stands beside the stiffness
        M = without_zeros(assemble_matrix(mass)) if shared else symmetric(assemble_matrix(mass))
        K = assemble_matrix(stiffness) if shared else symmetric(assemble_matrix(stiffness))
        interfaces = {key: interface(key, value, V, points) for key, value in facet_tags.items()}
    named = {region: solids[tag] for region, tag in regions.items()}
    remarks = list(doubts(named, float(np.ptp(points, axis=0).max()), name, degree))
    _warn(mesh.comm, remarks)
    doubts_found = list(dict.fromkeys(solid.doubt for solid in named.values() if solid.doubt))
    give_back()
    A, B = (K, M) if shared else (wrapped(K), wrapped(M))
    first, end = A.getOwnershipRange()
    return FEModel(
        K,
        M,
        points,
        interfaces,
        attachments=tuple(attachments),
        surface=outer_surface(V, points, degree),
        operators=PETScOperators(A, B, rigid_motions(points[first // 3 : end // 3])),
        stresses=Stresses(V, numbers, degree, (tags, regions)),
        regions=Regions(V, tags, solids, regions, degree),
        provenance={
            "material": described(named),
            "degree": degree,
            "degree of the geometry": geometry_degree(mesh),
            "cells": {name: mesh.topology.index_map(3).size_global},
            "units": "SI",
            "versions": versions(),
            "warnings": [*doubts_found, *remarks],  # the first where the materials were made
        },
    )


def _check_mesh(mesh: Any, degree: int) -> str:
    name = cell_name(mesh)
    if name not in ("tetrahedron", "hexahedron"):
        raise MeshError(f"the mesh has cells of the kind {name}; it takes tetrahedra or hexahedra.")
    if degree not in DEGREES:
        raise ConfigError(f"degree = {degree!r}; the displacement may have degree 1, 2 or 3.")
    if degree < (curved := geometry_degree(mesh)):
        raise MeshError(
            f"the cells have curved edges of degree {curved}, on which displacements of degree "
            f"{degree} would strain when the body turns.",
            hint="Use degree=2, or a mesh with straight edges.",
        )
    return name


def _cell_regions(mesh: Any, cell_tags: Any, regions: dict[str, int]) -> Index:
    """(cells of this rank with ghosts,) tag of each cell."""
    cells = mesh.topology.index_map(3)
    tags = np.full(cells.size_local + cells.num_ghosts, min(regions.values()), dtype=np.int64)
    if len(regions) == 1:
        return tags
    if cell_tags is None:
        raise TagError(f"the regions {sorted(regions)} are named, but no cell is tagged.")
    tags -= 1
    tags[cell_tags.indices] = cell_tags.values
    owned = tags[: cells.size_local]
    if n_unknown := np.count_nonzero(~np.isin(owned, list(regions.values()))):
        raise TagError(f"{n_unknown} cells belong to none of the regions {sorted(regions)}.")
    return tags


def _check_attachments(attached: Sequence[Attachment], names: dict[str, Any]) -> None:
    for item in attached:
        if item.interface not in names:
            raise InterfaceError(
                f"a mass of {item.mass:g} kg hangs on {item.interface!r}, "
                f"but the interfaces are {sorted(names)}."
            )


def _warn(comm: MPI.Comm, remarks: list[str]) -> None:
    for remark in remarks if comm.rank == 0 else ():
        warn(remark)
