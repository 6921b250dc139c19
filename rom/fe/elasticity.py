"""Stiffness and mass of a three-dimensional elastic body on a dolfinx mesh."""

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import Mesh

from rom.arguments import one_of, typed, whole
from rom.eigen.verbs import mean_motion, rigid_motions
from rom.errors import ConfigError, InterfaceError, MeshError, TagError, in_file, warn
from rom.fe.compat import MeshTags, assemble_matrix, cell_name, geometry_degree, lagrange, versions
from rom.fe.costs import LEAST_SHARED_DOFS, reduction_seconds
from rom.fe.forms.material import by_region, coefficients, described, doubts
from rom.fe.forms.nodes import all_points, interface, outer_surface
from rom.fe.forms.region import Regions, forms
from rom.fe.forms.stress import Stresses
from rom.fe.jit import compiling
from rom.fe.mesh.curving import without_middles
from rom.fe.mesh.quality import layer_doubt
from rom.fe.mesh.solid import SolidMesh
from rom.fe.mesh.ties import of_degree, sprung, tied
from rom.fe.operators.aij import symmetric, without_zeros, wrapped
from rom.fe.operators.foreseen import COUPLED_NODES, automatic, check_indices
from rom.fe.operators.memory import give_back
from rom.fe.operators.petsc import PETScOperators, WholeOperators
from rom.fe.operators.solver import DIRECT_SOLVER, parsed
from rom.fe.operators.workers import AllRanks
from rom.fe.parallel import collective, install_abort_hook, on_root
from rom.model import Attachment, FEModel, Index, Material, Orthotropic
from rom.names import check_known, named

log = logging.getLogger("rom")
Solids = Material | Orthotropic | Mapping[str, Material | Orthotropic]
WHOLE_REGION = "solid"  # name of the only region of a mesh without named regions
HIGHEST_DEGREE = 3  # of the displacement
SOME_COORDINATES, SOME_MODES = 12, 20  # of two stiff interfaces, for the time of a small model


@typed
def model(
    path: str | Path,
    *,
    material: Solids | None = None,
    degree: int = 2,
    parameters: dict[str, float] | None = None,
    attachments: Sequence[Attachment] = (),
    solver: str = "auto",
    comm: MPI.Comm = MPI.COMM_WORLD,
    **mesh_options: Any,
) -> FEModel:
    """Finite element model of the solid in a geometry or mesh file.

    Args:
        path: ``.geo``, ``.py``, ``.step``, ``.msh``, ``.unv``, ``.med``, ``.inp``, ``.bdf`` or
            ``.cdb``, see `rom.fe.mesh.read.read_mesh`.
        material: `Material`, `Orthotropic`, or {region name: material}; needless where a deck says
            its own, whose place it takes.
        degree: polynomial degree of the displacement, 1 to 3; 2 unless you know better.
        parameters: {name: value} of the geometry's parameters, in the units of the geometry.
        attachments: point masses and rigid bodies carried by interfaces, beside those of a deck.
        solver: how equations are solved. "auto": the first of "direct", "out-of-core" and
            "iterative" that fits into memory, named in ``provenance["solver"]``; "direct": a
            MUMPS factor, the fastest when it fits; "low-rank" or "low-rank:1e-8": the same with
            compressed blocks; "out-of-core": the factor on disk; "low-rank+out-of-core";
            "iterative": multigrid, with little memory; that no mode is missed is then shown by
            random loads, with the probability in ``provenance["stages"]``.
        comm: the ranks that share the model.
        mesh_options: ``scale``, ``units``, ``faces``, ``order``, ``trust``, ``time_limit`` and
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
        ResourceError: if meshing exceeds its limit of time or memory, no way to solve would fit, or
            PETSc cannot count so many dofs.
        MaterialError: if a region has no material or a material no region.
        InterfaceError: if an interface is empty or an attachment hangs on none.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)  # 1 m x 50 mm x 30 mm
        >>> beam.interface_names
        ('root', 'tip')
    """
    options = _Options(path, material, degree, parameters, tuple(attachments), solver, comm)
    (made,) = _models(options, mesh_options, lambda mesh: {"": mesh}).values()
    n = made.n_dofs
    if comm.rank == 0 and comm.size > 1 and n < LEAST_SHARED_DOFS:
        seconds = reduction_seconds(n, SOME_COORDINATES, SOME_MODES)
        log.warning(
            f"{n} dofs are shared by {comm.size} processes; below {LEAST_SHARED_DOFS} one process "
            f"is faster, and reduces them to {SOME_COORDINATES} interface coordinates and "
            f"{SOME_MODES} modes in about {max(seconds, 0.1):.1f} s."
        )
    return made


@typed
def pieces(  # noqa: PLR0913  those of `model`, and how to cut
    path: str | Path,
    *,
    n: int | None = None,
    axis: Any = None,
    material: Solids | None = None,
    degree: int = 2,
    parameters: dict[str, float] | None = None,
    attachments: Sequence[Attachment] = (),
    solver: str = "auto",
    comm: MPI.Comm = MPI.COMM_WORLD,
    **mesh_options: Any,
) -> dict[str, FEModel]:
    """{name: finite element model} of the pieces of a solid, for `rom.reduce_pieces`.

    Where two pieces meet both have an interface of one name: "cut 1" between the pieces "1" and
    "2" along an axis, "hub-blade" between two regions. All have the coordinates of the whole.

    Args:
        path: geometry or mesh file, see `model`.
        n: number of pieces of about equal length, cut between layers of cells.
        axis: (3,) normal of the cuts [1]; without n and axis each region is a piece.
        material: as for the whole.
        degree: as for `model`, as are all that follow.
        parameters: of the geometry.
        attachments: each goes with the piece that has its interface.
        solver: how equations are solved.
        comm: the ranks that share each of the models.
        mesh_options: see `model`.

    Raises:
        MeshError: if there are fewer layers of cells than pieces, or these are not flat.
        TagError: if there is nowhere to cut, or a cut crosses a named surface.
        RomError: see `model`.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> grid = {"hex": 1, "nx": 6, "ny": 1, "nz": 1}
        >>> beam = {"n": 2, "axis": (1, 0, 0), "material": steel, "parameters": grid}
        >>> models = rom.fe.pieces("meshes/beam.geo", **beam)
        >>> {name: model.interface_names for name, model in models.items()}
        {'1': ('root', 'cut 1'), '2': ('tip', 'cut 1')}
    """
    from rom.fe.mesh.cut import cut

    options = _Options(path, material, degree, parameters, tuple(attachments), solver, comm)

    def division(mesh: SolidMesh) -> dict[str, SolidMesh]:
        if mesh.ties:
            text = f"the deck ties or loads nodes of the whole, {named(mesh.ties)}"
            raise MeshError(f"{text}; use rom.fe.model, or take them out.")
        return cut(mesh, n, axis)

    return _models(options, mesh_options, division)


@dataclass(frozen=True)
class _Options:
    """What `model` and `pieces` are asked for."""

    path: str | Path
    material: Solids | None
    degree: int
    parameters: dict[str, float] | None
    attachments: tuple[Attachment, ...]
    solver: str
    comm: MPI.Comm


Division = Callable[[SolidMesh], dict[str, SolidMesh]]


def _models(
    options: _Options, mesh_options: dict[str, Any], division: Division
) -> dict[str, FEModel]:
    """Models of the parts into which a mesh is divided on rank 0; the others never hold it."""
    from rom.fe.mesh.read import is_geometry, read_mesh
    from rom.fe.mesh.validate import checked

    parsed(options.solver)  # before a mesh is made in vain
    whole("degree", options.degree, 1, HIGHEST_DEGREE)
    install_abort_hook(options.comm)  # whatever a script does next, one failing rank must end all
    parts: dict[str, SolidMesh] = {}

    def head() -> tuple[Solids, dict[str, SolidMesh]]:
        if options.degree == 1 and mesh_options.get("order") is None and is_geometry(options.path):
            mesh_options["order"] = 1
        mesh = read_mesh(options.path, parameters=options.parameters, **mesh_options)
        with in_file(options.path):
            mesh = without_middles(replace(mesh, ties=of_degree(mesh, options.degree)))
        if doubt := layer_doubt(mesh, options.degree):
            warn(doubt)
            mesh = replace(mesh, warnings=(*(mesh.warnings or ()), doubt))
        material = mesh.solids() if options.material is None else options.material
        if options.material is not None and mesh.materials:
            log.warning("material= takes the place of the materials that %s says.", options.path)
        by_region(material, {name: tag for tag, name in mesh.region_names.items()})
        _check_attachments(options.attachments, mesh.facets.keys() | mesh.ties.keys())
        for name, part in division(mesh).items():
            parts[name] = part if part.warnings is not None else checked(part)
        return material, {name: _without_cells(part) for name, part in parts.items()}

    material, heads = on_root(options.comm, head)
    return {key: _model(options, material, parts.pop(key, None), one) for key, one in heads.items()}


def _without_cells(mesh: SolidMesh) -> SolidMesh:
    """What all ranks know of a mesh that rank 0 holds."""
    tables = ("points", "cells", "regions")
    none = {name: getattr(mesh, name)[:0].copy() for name in tables}  # a view would keep all
    return replace(mesh, **none, facets={}, cell_ids=None, faces=())


def _model(options: _Options, material: Solids, part: SolidMesh | None, head: SolidMesh) -> FEModel:
    """The model of one mesh, which rank 0 holds."""
    from rom.fe.mesh.read import to_dolfinx

    comm, regions = options.comm, {name: tag for tag, name in head.region_names.items()}
    with compiling(comm):
        mesh, cell_tags, facet_tags = to_dolfinx(part, comm)
    if isinstance(material, Mapping):
        material = {region: material[region] for region in regions}
    made = assemble(
        mesh, cell_tags, facet_tags, material=material, degree=options.degree, regions=regions
    )
    remarks = [*(head.warnings or ()), *made.provenance["warnings"]]
    method = parsed(options.solver)
    how, why = automatic(made.operators) if method.automatic else (method, options.solver)
    if comm.rank == 0 and how != DIRECT_SOLVER and method.automatic:
        log.info("solved %s", why)
    interfaces = dict(made.interfaces)
    for key in head.axes.keys() & interfaces.keys():  # of the CAD, which knows these
        point, along = np.array(head.axes[key].point), np.array(head.axes[key].direction)
        interfaces[key] = replace(interfaces[key], origin=point, axis=along)
    for key, tie in head.ties.items():
        interfaces[key] = tied(key, tie, made.points, interfaces.get(key))
    made = replace(
        made,
        interfaces=interfaces,
        kinds={key: tie.kind for key, tie in head.ties.items() if tie.kind == "rbe2"},
        attachments=(*(x for x in options.attachments if x.interface in interfaces), *head.carried),
        operators=made.operators.solved_by(how),
        provenance=head.provenance | made.provenance | {"warnings": remarks, "solver": why},
    )
    for name in [key for key, tie in head.ties.items() if tie.kind]:
        mean_motion(interfaces[name])  # refuses those on a line
    return sprung(made, head.springs) if head.springs else made


@typed
def assemble(
    mesh: Any,
    cell_tags: Any = None,
    facet_tags: dict[str, Any] | None = None,
    *,
    material: Solids,
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

    Raises:
        ConfigError, MeshError, TagError, MaterialError, InterfaceError: see `model`.
        ResourceError: if PETSc cannot count so many dofs or entries.
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
        nodes, coupled = V.dofmap.index_map, COUPLED_NODES[name][degree - 1]
        n_most = mesh.comm.allreduce(nodes.size_local, op=MPI.MAX)
        check_indices(3 * nodes.size_global, 9 * coupled * n_most)
        points = all_points(V)
        numbers = coefficients(mesh, tags, solids)
        stiffness, mass = forms(V, numbers, degree)
        # the mass first: a third of it is kept, and less stands beside the stiffness
        M = without_zeros(assemble_matrix(mass)) if shared else symmetric(assemble_matrix(mass))
        K = assemble_matrix(stiffness) if shared else symmetric(assemble_matrix(stiffness))
        interfaces = {key: interface(key, value, V, points) for key, value in facet_tags.items()}
    made_of = {region: solids[tag] for region, tag in regions.items()}
    remarks = list(doubts(made_of, float(np.ptp(points, axis=0).max()), name, degree))
    for remark in remarks if mesh.comm.rank == 0 else ():
        warn(remark)
    doubts_found = list(dict.fromkeys(solid.doubt for solid in made_of.values() if solid.doubt))
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
            "material": described(made_of),
            "degree": degree,
            "degree of the geometry": geometry_degree(mesh),
            "cells": {name: mesh.topology.index_map(3).size_global},
            "units": "SI",
            "versions": versions(),
            "warnings": [*doubts_found, *remarks],  # the first where the materials were made
        },
    )


def _check_mesh(mesh: Mesh, degree: int) -> str:
    name = cell_name(mesh)
    one_of("the kind of cells", name, ("tetrahedron", "hexahedron"), error=MeshError)
    whole("degree", degree, 1, HIGHEST_DEGREE)
    if degree < (curved := geometry_degree(mesh)):
        raise MeshError(
            f"the cells have curved edges of degree {curved}, on which displacements of degree "
            f"{degree} would strain when the body turns.",
            hint="Use degree=2, or a mesh with straight edges.",
        )
    return name


def _cell_regions(mesh: Mesh, cell_tags: MeshTags | None, regions: dict[str, int]) -> Index:
    """(cells of this rank with ghosts,) tag of each cell."""
    cells = mesh.topology.index_map(3)
    tags = np.full(cells.size_local + cells.num_ghosts, min(regions.values()), dtype=np.int64)
    if len(regions) == 1:
        return tags
    if cell_tags is None:
        raise TagError(f"the regions {sorted(regions)} are named without cells; give cell_tags.")
    tags -= 1
    tags[cell_tags.indices] = cell_tags.values
    owned = tags[: cells.size_local]
    if n_unknown := np.count_nonzero(~np.isin(owned, list(regions.values()))):
        raise TagError(f"{n_unknown} cells belong to none of the regions {sorted(regions)}.")
    return tags


def _check_attachments(attached: Sequence[Attachment], names: Iterable[str]) -> None:
    for item in attached:
        text = f"a mass of {item.mass:g} kg hangs on {item.interface!r}; use one of"
        check_known(item.interface, names, text, InterfaceError)


@typed
def by_mumps(model: FEModel) -> FEModel:
    """A model of matrices, as `rom.read_model` gives, solved by MUMPS in place of SciPy.

    With 100 000 dofs that is about ten times as fast. Under mpirun each rank solves all of it.

    Raises:
        ConfigError: for a model of finite elements, which MUMPS solves already.
        QualityGateError: naming a dof without mass and stiffness.
    """
    if model.operators is not None:
        raise ConfigError("the model consists of finite elements, which MUMPS solves already.")
    ops = AllRanks(1, WholeOperators).operators(model.K, model.M, model.rigid_motions())
    return replace(model, operators=ops)
