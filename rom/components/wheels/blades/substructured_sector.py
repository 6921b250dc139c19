"""A sector of two substructures, disk and blade, joined by a-priori functions on the root.

A blade that is cut from its disk keeps the coefficients a of functions on its root, and its modes
with the root held, the cantilever modes, which a test bench measures blade by blade::

    u = Psi_root a + Phi eta,    K = diag(K_root, omega_k^2),    M = [[M_root, L], [L^T, I]]

Blades with equal functions fit on one disk, whatever their mesh, material or shape.

Source:
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313.
    Castanier, Ottarsson and Pierre, A reduced order modeling technique for mistuned bladed disks,
    J. Vibration and Acoustics 119 (1997) 439: deviations of the cantilever blades.
"""

from dataclasses import dataclass, field, fields, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix, identity

from rom.arguments import typed, vector
from rom.checks.draft import run
from rom.components.wheels import reduced
from rom.components.wheels.faces import interpolation
from rom.components.wheels.reduced import Functions, ReducedSector, SectorDraft
from rom.components.wheels.rotation import arms, centrifugal_displacement, rotation_matrices
from rom.components.wheels.sector import NO_DOFS, CyclicSector, all_rows, region, stresses_of
from rom.eigen.verbs import dofs_of, every_row, own_rows, static_shapes
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Index, Interface
from rom.names import check_known
from rom.reduction.interfaces.polynomial import Polynomial, interface_functions


class Stresses(Protocol):
    """What evaluates the stress of finite elements."""

    def prestress(self, u: Array) -> csr_matrix:
        """(n, n) geometric stiffness [N/m] of the stress at the displacement u (n,) [m]."""


@typed
@dataclass(frozen=True)
class ReducedBlade:
    """One blade in r coordinates of its root, then m cantilever modes.

    Attributes:
        K: (r + m, r + m) stiffness [N/m; 1/s^2].
        M: (r + m, r + m) mass [kg; 1].
        Psi: (n, r + m) displacement shapes on the dofs of the model the blade comes from [1;
            kg^-1/2].
        n_root: number r of root coordinates.
        coriolis: (r + m, r + m) skew-symmetric Coriolis matrix per rad/s [kg], or None.
        centrifugal: (r + m, r + m) change of K per (rad/s)^2: geometric stiffness of centrifugal
            stress less spin softening [kg]; None for a blade at rest.
    """

    K: Array
    M: Array
    Psi: Array
    n_root: int
    coriolis: Array | None = None
    centrifugal: Array | None = None

    @property
    def n_modes(self) -> int:
        """Number m of cantilever modes."""
        return len(self.K) - self.n_root

    @property
    def omega(self) -> Array:
        """(m,) circular frequencies of the cantilever blade [rad/s]."""
        modes = slice(self.n_root, None)
        return np.sqrt(self.K.diagonal()[modes] / self.M.diagonal()[modes])

    def varied(
        self, *, stiffness: float = 0.0, density: float = 0.0, cantilever: npt.ArrayLike = ()
    ) -> "ReducedBlade":
        """The blade with other parameters.

        Centrifugal stress follows from equilibrium: it grows with the density, not the stiffness.

        Args:
            stiffness: relative deviation of the stiffness of the blade [1].
            density: relative deviation of its density [1].
            cantilever: (k,) relative deviations of its first k cantilever frequencies [1], beyond
                what the two others do; shapes and root keep theirs.

        Raises:
            ConfigError: for a deviation not above -1, or of a mode the blade does not have.
        """
        delta = vector("cantilever", cantilever) if np.size(cantilever) else np.zeros(0)
        all_of_them = np.r_[stiffness, density, delta]
        if all_of_them.min() <= -1.0:
            raise ConfigError(f"deviations {all_of_them}: each must be a number above -1.")
        if delta.size > self.n_modes:
            raise ConfigError(f"{delta.size} deviations for {self.n_modes} cantilever modes.")
        K = (1.0 + stiffness) * self.K
        modes = self.n_root + np.arange(delta.size)
        K[modes, modes] *= (1.0 + delta) ** 2
        grown = {name: getattr(self, name) for name in ("M", "coriolis", "centrifugal")}
        heavy = {name: (1.0 + density) * A for name, A in grown.items() if A is not None}
        return replace(self, K=K, **heavy)


@dataclass(frozen=True)
class SubstructuredSector(ReducedSector):
    """Coordinates: two cyclic faces, the root, modes of the disk, cantilever modes of the blade.

    Attributes:
        blade: the nominal blade, in its root coordinates and its cantilever modes.
        root: (r,) which coordinates are those of the root.
        cantilever: (m,) which are cantilever modes.
        root_points: (k, 3) nodes of the root [m].
        root_functions: (k, r / 3) functions on it [1], alike for the three directions.
        root_moved: (k, 3) displacement of the root in a wheel at 1 rad/s [m]; None at rest.
    """

    blade: ReducedBlade | None = None
    root: Index = field(default_factory=lambda: NO_DOFS)
    cantilever: Index = field(default_factory=lambda: NO_DOFS)
    root_points: Array | None = None
    root_functions: Array | None = None
    root_moved: Array | None = None


# of the root's size: distance and difference in size of two roots that match
ROOT_MATCH_RTOL = 0.05
SHARED_STIFFNESS_RTOL = 1e-9  # of a dof's stiffness: round-off of what other regions add


@typed
def reduced_blade(
    sector: SubstructuredSector,
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
        text = f"the blade has no interface {root!r}; it has"
        check_known(root, model.interfaces, text, InterfaceError)
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
    K_small, M_small = (0.5 * (A + A.T) for A in (Psi.T @ (B @ Psi) for B in (K, M)))
    K_small[:n_root, n_root:] = 0.0  # by orthogonality; what is there is round-off
    K_small[n_root:, :n_root] = 0.0
    return ReducedBlade(K_small, M_small, Psi, n_root)


def turning(
    blade: ReducedBlade, M: csr_matrix, stresses: Stresses, axis: Array, u: Array
) -> ReducedBlade:
    """The blade with the matrices of its rotation about a unit vector; u (n,) at 1 rad/s [m]."""
    G, softening = rotation_matrices(M, axis)
    Psi = blade.Psi
    C = Psi.T @ ((stresses.prestress(u) - softening) @ Psi)
    return replace(blade, coriolis=Psi.T @ (G @ Psi), centrifugal=0.5 * (C + C.T))


def cut(K: csr_matrix, K_blade: csr_matrix, name: str) -> tuple[Index, Index]:
    """Inner dofs of a blade, and nodes of its root: those it shares with the rest."""
    total, mine = K.diagonal(), K_blade.diagonal()
    shared = (mine > 0.0) & (total - mine > SHARED_STIFFNESS_RTOL * total)
    nodes = np.flatnonzero(shared.reshape(-1, 3).any(axis=1))
    if nodes.size == 0:
        text = f"region {name!r} shares no node with the rest of the sector"
        raise InterfaceError(f"{text}; mesh both as one solid.")
    return np.setdiff1d(np.flatnonzero(mine > 0.0), dofs_of(nodes)), nodes


def root_of(model: FEModel, nodes: Index) -> Interface:
    """The root as an interface; as each node weighs alike, no facets are needed."""
    points = model.points[nodes]
    equal = identity(nodes.size, format="csr") / nodes.size
    return Interface("root of the blade", nodes, points, equal, points.mean(axis=0))


def _same_surface(sector: SubstructuredSector, points: Array) -> csr_matrix:
    """(k, m) values at nodes of the root of another blade from those at the root of a sector."""
    own = sector.root_points
    size = np.ptp(own, axis=0).max()
    boxes = [np.array([p.min(axis=0), p.max(axis=0)]) for p in (own, points)]
    apart = np.abs(boxes[0] - boxes[1]).max()
    if apart > ROOT_MATCH_RTOL * size:
        text = f"the root of this blade ends up to {apart:.3g} m from that of the sector"
        why = f"{size:.3g} m wide; only above it may blades differ in shape."
        raise InterfaceError(f"{text}, {why}")
    return interpolation(own, points)


@typed
def substructured_sector(
    sector: CyclicSector,
    model: FEModel,
    *,
    n_modes: int,
    n_blade_modes: int,
    functions: Functions | None = None,
    root: Functions | None = None,
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
        raise ConfigError("substructures need the full sector of this model: from_model.")
    K_blade, M_blade = region(model, blade)
    _refuse_stiffened(sector, model, K_blade.diagonal() > 0.0)
    inner, nodes = cut(sector.K, K_blade, blade)
    shared, faces = dofs_of(nodes), np.union1d(sector.slave, sector.master)
    if np.intersect1d(np.union1d(inner, shared), faces).size:
        text = f"the blade {blade!r} reaches a cyclic face"
        raise InterfaceError(f"{text}; cut the wheel between the blades.")
    face = root_of(model, nodes)
    Q_root = interface_functions(root or Polynomial(3), face)
    kinds, r = {reduced.CYCLIC_FACES: functions or Polynomial(4)}, 3 * Q_root.shape[1]
    disk = np.union1d(np.union1d(np.union1d(faces, sector.held), shared), inner)
    parts = (disk, n_modes), (np.setdiff1d(np.arange(sector.n), inner), n_blade_modes)
    draft = SectorDraft(model=sector, interfaces=kinds, root=(shared, Q_root), parts=parts)
    steps = reduced.connect_faces, reduced.connect_root, reduced.basis, reduced.project
    small, q = run(steps, draft), draft.q
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
        text = "the blade has more than stiffness of its finite elements: see rom.heated_sector."
        raise ConfigError(text, hint="Substructure it without heat, or use rom.reduce_sector.")
