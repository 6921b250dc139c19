"""Blades as substructures: the motion of a root that all share, and cantilever modes of their own.

A blade that is cut from its disk keeps the coefficients a of functions on its root, and its modes
with the root held, the cantilever modes, which a test bench measures blade by blade::

    u = Psi_root a + Phi eta,    K = diag(K_root, omega_k^2),    M = [[M_root, L], [L^T, I]]

Blades with equal functions fit on one disk, whatever their mesh, material or shape.

Source:
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313.
    Castanier, Ottarsson and Pierre, A reduced order modeling technique for mistuned bladed disks,
    J. Vibration and Acoustics 119 (1997) 439: deviations of the cantilever blades.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csr_matrix, identity

from rom.arguments import typed
from rom.components.wheels.blades.records import ReducedBlade
from rom.components.wheels.faces import interpolation
from rom.components.wheels.rotation import arms, rotation_matrices
from rom.components.wheels.sector import all_rows, region
from rom.eigen.verbs import dofs_of, every_row, own_rows, static_shapes
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Index, Interface
from rom.names import check_known

if TYPE_CHECKING:
    from rom.components.wheels.blades.records import SubstructuredSector

# of the root's size: distance and difference in size of two roots that match
ROOT_MATCH_RTOL = 0.05
SHARED_STIFFNESS_RTOL = 1e-9  # of a dof's stiffness: round-off of what other regions add


@typed
def reduced_blade(
    sector: "SubstructuredSector",
    model: FEModel,
    *,
    n_modes: int,
    blade: str | None = "blade",
    root: str | None = None,
) -> ReducedBlade:
    """A blade of other shape, mesh or material that fits on the disk of a sector.

    On a sector with matrices of rotation it has its own: those of its centrifugal stress when the
    root moves with the disk as that of the sector does.

    Args:
        sector: with the functions of the root.
        model: finite elements of the blade, in place: a sector with the blade as a region, or the
            blade alone.
        n_modes: number of cantilever modes.
        blade: name of the region; None if the model is the blade alone.
        root: name of the interface of a blade alone that stands on the disk.

    Raises:
        ConfigError: if the region is unknown, or the blade cannot have so many modes.
        InterfaceError: if the root is unknown, or not that of the sector.

    Source:
        Craig and Bampton, AIAA J. 6 (1968) 1313, with polynomials on the root as in Carassale
        and Maurici (2018); see docs/theory/cyclic_symmetry.md.
    """
    if blade is None:
        check_known(
            root, model.interfaces, f"the blade has no interface {root!r}; it has", InterfaceError
        )
        K, M = all_rows(model, model.K), all_rows(model, model.M)
        inner, nodes = np.arange(model.n_dofs), model.interfaces[root].nodes
    else:
        K, M = region(model, blade)
        inner, nodes = cut(all_rows(model, model.K), K, blade)
    like = _same_surface(sector, model.points[nodes])
    Q, dofs = like @ sector.root_functions, dofs_of(nodes)
    E = np.zeros((K.shape[0], 3 * Q.shape[1]))
    E[dofs] = np.kron(Q, np.eye(3))
    mine = np.union1d(inner, dofs)
    ops = sector.workers.operators(K[mine][:, mine], M[mine][:, mine], together=True)
    held = ops.hold(np.searchsorted(mine, dofs))
    _, Phi = ops.modes(held, n_modes)
    Psi = np.zeros((K.shape[0], E.shape[1] + n_modes))
    E = own_rows(ops, E[mine])
    Psi[mine] = every_row(ops, np.hstack([static_shapes(ops, held, E), Phi]))
    found = blade_in(K, M, Psi, E.shape[1])
    if sector.root_moved is None:
        return found
    u = np.zeros((K.shape[0], 1))
    u[dofs, 0] = (like @ sector.root_moved).ravel()
    pull = (M @ arms(sector, model.points).ravel())[:, None]
    pull = own_rows(ops, pull[mine]) - ops.apply_K(own_rows(ops, u[mine]))
    u[mine] += every_row(ops, held(pull))
    return turning(found, M, stresses_of(model, blade), sector.axis, u[:, 0])


def blade_in(K: csr_matrix, M: csr_matrix, Psi: Array, n_root: int) -> ReducedBlade:
    """The blade with these matrices in the coordinates of Psi; K is free of root-mode coupling."""
    K_small, M_small = Psi.T @ (K @ Psi), Psi.T @ (M @ Psi)
    K_small[:n_root, n_root:] = 0.0  # by orthogonality; what is there is round-off
    K_small[n_root:, :n_root] = 0.0
    return ReducedBlade(0.5 * (K_small + K_small.T), 0.5 * (M_small + M_small.T), Psi, n_root)


def turning(blade: ReducedBlade, M: csr_matrix, stresses: Any, axis: Array, u: Array) -> Any:
    """The blade with the matrices of its rotation.

    Args:
        blade: at rest.
        M: (n, n) its mass [kg].
        stresses: of its elements alone.
        axis: (3,) unit vector.
        u: (n,) displacement at 1 rad/s [m].
    """
    G, softening = rotation_matrices(M, axis)
    Psi = blade.Psi
    C = Psi.T @ ((stresses.prestress(u) - softening) @ Psi)
    return replace(blade, coriolis=Psi.T @ (G @ Psi), centrifugal=0.5 * (C + C.T))


def stresses_of(model: FEModel, blade: str | None) -> Any:
    """Stress that the elements of a blade carry.

    Raises:
        ConfigError: if there are none.
    """
    found = (model if blade is None else model.regions[blade]).stresses
    if found is None:
        raise ConfigError(
            "the model of the blade has no finite elements, from which alone the stiffness of "
            "centrifugal stress follows.",
            hint="Make it with rom.fe.model, or its disk without rom.rotating_sector.",
        )
    return found


def cut(K: csr_matrix, K_blade: csr_matrix, name: str) -> tuple[Index, Index]:
    """Inner dofs of a blade, and nodes of its root: those it shares with the rest.

    Raises:
        InterfaceError: if it shares none.
    """
    total, mine = K.diagonal(), K_blade.diagonal()
    shared = (mine > 0.0) & (total - mine > SHARED_STIFFNESS_RTOL * total)
    nodes = np.flatnonzero(shared.reshape(-1, 3).any(axis=1))
    if nodes.size == 0:
        raise InterfaceError(
            f"region {name!r} shares no node with the rest of the sector.",
            hint="Mesh blade and disk as one solid, so that they have the nodes of the root alike.",
        )
    return np.setdiff1d(np.flatnonzero(mine > 0.0), dofs_of(nodes)), nodes


def root_of(model: FEModel, nodes: Index) -> Interface:
    """The root as an interface; as each node weighs alike, no facets are needed."""
    points = model.points[nodes]
    equal = identity(nodes.size, format="csr") / nodes.size
    return Interface("root of the blade", nodes, points, equal, points.mean(axis=0))


def _same_surface(sector: "SubstructuredSector", points: Array) -> csr_matrix:
    """(k, m) values at nodes of the root of another blade from those at the root of a sector.

    Raises:
        InterfaceError: if the nodes cover another surface.
    """
    own = sector.root_points
    size = np.ptp(own, axis=0).max()
    boxes = [np.array([p.min(axis=0), p.max(axis=0)]) for p in (own, points)]
    apart = np.abs(boxes[0] - boxes[1]).max()
    if apart > ROOT_MATCH_RTOL * size:
        raise InterfaceError(
            f"the root of this blade ends up to {apart:.3g} m from that of the sector, which is "
            f"{size:.3g} m wide.",
            hint="Only above the root may blades differ in shape.",
        )
    return interpolation(own, points)
