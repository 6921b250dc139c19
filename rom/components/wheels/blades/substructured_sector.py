"""A sector of two substructures, disk and blade, joined by a-priori functions on the root."""

from dataclasses import fields

import numpy as np

from rom.arguments import typed
from rom.checks.draft import run
from rom.components.wheels.blades.blade import (
    SHARED_STIFFNESS_RTOL,
    blade_in,
    cut,
    root_of,
    stresses_of,
    turning,
)
from rom.components.wheels.blades.records import SubstructuredSector
from rom.components.wheels.reduced import (
    CYCLIC_FACES,
    ReducedSector,
    SectorDraft,
    basis,
    connect_faces,
    connect_root,
    project,
)
from rom.components.wheels.rotation import centrifugal_displacement
from rom.components.wheels.sector import CyclicSector, all_rows, region
from rom.eigen.verbs import dofs_of
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel
from rom.reduction.interfaces.polynomial import FourierLegendre, Polynomial, interface_functions


@typed
def substructured_sector(
    sector: CyclicSector,
    model: FEModel,
    *,
    n_modes: int,
    n_blade_modes: int,
    functions: Polynomial | FourierLegendre | None = None,
    root: Polynomial | FourierLegendre | None = None,
    blade: str = "blade",
) -> SubstructuredSector:
    """Craig-Bampton reduction of disk and blade, with a-priori functions on all faces.

    As `rom.reduce_sector`, and the blade is cut off where it shares nodes with the rest: both sides
    follow the same functions there, so that frequencies are never below those of the full sector.
    All of rom.cyclic takes the result like any sector, at speed if this one has matrices of
    rotation, see `rom.rotating_sector`; `rom.bladed_wheel` gives each of its blades
    parameters or a shape of its own.

    Args:
        sector: the full sector, made from the model by `CyclicSector.from_model`.
        model: the finite elements, with the blade as a region.
        n_modes: number of modes of the disk with its cyclic faces and the root held.
        n_blade_modes: number of cantilever modes.
        functions: on the cyclic faces; `Polynomial` of order 4 unless given.
        root: on the root of the blade; `Polynomial` of order 3 unless given.
        blade: name of the region.

    Raises:
        ConfigError: if the region or the geometry of the faces is missing, for too many modes, or
            if the blade of the sector has stiffness that its finite elements do not.
        InterfaceError: if the blade shares no node with the disk, or reaches a cyclic face.

    Source:
        Castanier, Ottarsson and Pierre, J. Vibration and Acoustics 119 (1997) 439; polynomials on
        the interfaces as in `rom.reduce_sector`.
    """
    if sector.face is None or sector.n != model.n_dofs:
        raise ConfigError(
            "substructures need the full sector and the model it was made from.",
            hint="Make the sector with rom.CyclicSector.from_model.",
        )
    K_blade, M_blade = region(model, blade)
    _refuse_stiffened(sector, model, K_blade.diagonal() > 0.0)
    inner, nodes = cut(sector.K, K_blade, blade)
    shared, faces = dofs_of(nodes), np.union1d(sector.slave, sector.master)
    if np.intersect1d(np.union1d(inner, shared), faces).size:
        raise InterfaceError(
            f"the blade {blade!r} reaches a cyclic face, on which sectors meet.",
            hint="Cut the wheel between the blades.",
        )
    face = root_of(model, nodes)
    Q_root = interface_functions(root or Polynomial(3), face)
    kinds, r = {CYCLIC_FACES: functions or Polynomial(4)}, 3 * Q_root.shape[1]
    disk = np.union1d(np.union1d(np.union1d(faces, sector.held), shared), inner)
    parts = (disk, n_modes), (np.setdiff1d(np.arange(sector.n), inner), n_blade_modes)
    draft = SectorDraft(model=sector, interfaces=kinds, root=(shared, Q_root), parts=parts)
    small, q = run((connect_faces, connect_root, basis, project), draft), draft.q
    root_at = 2 * q + np.arange(r)
    modes_at = 2 * q + r + n_modes + np.arange(n_blade_modes)
    Psi = np.zeros((sector.n, r + n_blade_modes))
    mine = np.union1d(inner, shared)
    Psi[mine] = small.Psi[np.ix_(mine, np.r_[root_at, modes_at])]
    own, moved = blade_in(K_blade, M_blade, Psi, r), None
    if sector.centrifugal is not None:
        u = centrifugal_displacement(sector)
        own = turning(own, M_blade, stresses_of(model, blade), sector.axis, u)
        moved = u[shared].reshape(-1, 3)
    return SubstructuredSector(
        **{f.name: getattr(small, f.name) for f in fields(ReducedSector)},
        blade=own,
        root=root_at,
        cantilever=modes_at,
        root_points=face.points,
        root_functions=Q_root,
        root_moved=moved,
    )


def _refuse_stiffened(sector: CyclicSector, model: FEModel, of_blade: Array) -> None:
    """What heat adds to a sector cannot be told apart into disk and blade."""
    own = all_rows(model, model.K).diagonal()[of_blade]
    if np.any(abs(sector.K.diagonal()[of_blade] - own) > SHARED_STIFFNESS_RTOL * own):
        raise ConfigError(
            "the blade of the sector does not have the stiffness of its finite elements: what "
            "rom.heated_sector adds cannot be shared out between disk and blade.",
            hint="Substructure the sector without heat, or reduce it whole by rom.reduce_sector.",
        )
