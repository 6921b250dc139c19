"""One sector of a wheel, and the coordinates in which one harmonic of the wheel moves.

Displacements of sector j are seen in axes that are turned along with it, so that all sectors have
the same matrices. In a wave with n nodal diameters each sector repeats its neighbour with a phase::

    u_j = exp(i n j alpha) u_0,    alpha = 2 pi / N

and the faces on which sectors meet make one the function of the other, u_slave =
exp(i n s alpha) C u_master, with s = +1 or -1 and C the turn by alpha. That is all: the wheel falls
into problems of the size of a sector, one for each n from 0 to N / 2.

Source:
    Thomas, Dynamics of rotationally periodic structures, Int. J. Numer. Meth. Engng. 14 (1979) 81.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.sparse import block_diag, csr_matrix, identity, kron

from rom.arguments import finite, matrix, typed, unit_vector, whole
from rom.components.wheels.faces import paired, refuse_all_around, turned
from rom.eigen.attachments import added_mass
from rom.eigen.supports import Fixed, held_dofs
from rom.eigen.verbs import rigid_motions
from rom.eigen.workers import ONE_PROCESS, Workers
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Index, Interface, refuse_springs
from rom.names import check_known

Complex = npt.NDArray[np.complex128]
Matrix = Any  # sparse, dense or of another library: SciPy has no types
Value = TypeVar("Value")
NO_DOFS = np.zeros(0, dtype=np.int64)
PAIR_COST = 4.0  # of waves that travel, in real numbers of twice the size, over those that stand


@typed
@dataclass(frozen=True)
class CyclicSector:
    """Matrices of one sector and how its faces meet.

    Attributes:
        n_sectors: number N of sectors of the wheel.
        K: (n, n) stiffness [N/m], sparse.
        M: (n, n) mass [kg], sparse.
        slave: (s,) dofs of one face, which follow those of the other.
        master: (m,) dofs of the other face.
        coupling: (s, m) sparse map C from master to slave, with the turn by one sector.
        step: +1 if the slave meets the master of the next sector, -1 of the one before.
        held: (h,) dofs that do not move.
        points: (n / 3, 3) nodes [m], or None where dofs are not displacements of nodes.
        motions: (n, 6) motions without stiffness [1, m]: translations, then rotations about ``at``;
            None when they are not known, or held.
        face: the leading face with its nodes and area, or None.
        axis: (3,) unit vector of the axis of rotation [1].
        at: (3,) a point of it [m].
        matching: True when each node of a face has a partner on the other.
        coriolis: (n, n) skew-symmetric Coriolis matrix per rad/s [kg], or None.
        centrifugal: (n, n) change of the stiffness per (rad/s)^2 [kg]: geometric stiffness of the
            centrifugal stress less spin softening; None for a wheel at rest.
        regions: {region: (n, n) stiffness of its elements alone}.
        sprung: True when K has springs to the ground, see `supported_sector`.
        workers: who solves with these matrices, and shares what is independent: ranks that all
            have the sector, or one process.

    Raises:
        ConfigError: for fewer than two sectors, or a coupling that does not fit the faces.
        InterfaceError: if a dof is on both faces.
    """

    n_sectors: int
    K: Matrix
    M: Matrix
    slave: Index
    master: Index
    coupling: Matrix
    step: int = 1
    held: Index = field(default_factory=lambda: NO_DOFS)
    points: Array | None = None
    motions: Array | None = None
    face: Interface | None = None
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    at: Array = field(default_factory=lambda: np.zeros(3))
    matching: bool = True
    coriolis: Matrix = None
    centrifugal: Matrix = None
    regions: dict[str, Matrix] = field(default_factory=dict)
    sprung: bool = False
    workers: Workers = field(default=ONE_PROCESS, repr=False)

    def __post_init__(self) -> None:
        whole("n_sectors", self.n_sectors, 2)
        if np.intersect1d(self.slave, self.master).size:
            raise InterfaceError("a dof is on both cyclic faces; they meet at most on the axis.")
        matrix("coupling", self.coupling, (self.slave.size, self.master.size))

    @classmethod
    def from_model(
        cls,
        model: FEModel,
        *,
        low: str = "cyclic_low",
        high: str = "cyclic_high",
        axis: npt.ArrayLike = (0.0, 0.0, 1.0),
        at: npt.ArrayLike = (0.0, 0.0, 0.0),
        fixed: Fixed = (),
        regions: tuple[str, ...] = (),
    ) -> "CyclicSector":
        """Sector of a finite element model; the number of sectors follows from its faces.

        Under mpirun all ranks call, and each gets all rows of the sector. The mesh and its
        matrices are made in parallel. What is computed from the sector is computed on each rank
        alike, but for what falls into numbers of nodal diameters, `rom.wheel_modes`,
        `rom.mistuned_wheel` and certificates: the ranks share these, and all must ask.

        Faces with different nodes are tied by interpolation: the finer one follows the coarser.

        Args:
            model: one sector, with its two cyclic faces as interfaces.
            low: name of one cyclic face.
            high: name of the other.
            axis: (3,) direction of the axis of rotation [1].
            at: (3,) a point of it [m].
            fixed: names of interfaces that are held.
            regions: names of regions whose stiffness is kept apart, for blades that differ.

        Raises:
            ConfigError: if a region is unknown, or nodes turn.
            InterfaceError: if an interface is unknown, the angle between the faces does not divide
                the circle, they are no images of each other, or the axis runs through the sector.
            ResourceError: on all ranks, if the sector does not fit on each of them.
        """
        for name in (low, high):
            text = f"the sector has no interface {name!r}; it has"
            check_known(name, model.interfaces, text, InterfaceError)
        if model.n_dofs > model.points.size:
            text = "nodes of a sector only displace; those of the model turn, or it is reduced"
            raise ConfigError(f"{text} already.")
        e, at = unit_vector("axis", axis), finite("at", at, (3,))
        pair = paired(model.interfaces[low], model.interfaces[high], e, at)
        refuse_all_around(model.points, e, at)
        M, dM = all_rows(model, model.M), added_mass(model, 0, model.n_dofs)
        held = held_dofs(model.interfaces, fixed)
        return cls(
            n_sectors=pair.n_sectors,
            K=all_rows(model, model.K),
            M=M if dM is None else csr_matrix(M + dM),
            slave=pair.slave.dofs,
            master=pair.master.dofs,
            coupling=kron(pair.weights, turned(e, pair.step * 2 * np.pi / pair.n_sectors), "csr"),
            step=pair.step,
            held=held,
            points=model.points,
            motions=None if held.size else rigid_motions(model.points - at),
            face=pair.master,
            axis=e,
            at=at,
            matching=pair.matching,
            regions={name: region(model, name)[0] for name in regions},
            workers=workers_of(model),
        )

    @property
    def n(self) -> int:
        """Number of dofs of one sector."""
        return int(self.K.shape[0])

    @property
    def supported(self) -> bool:
        """True when something is held, or stands on springs."""
        return self.held.size > 0 or self.sprung

    @property
    def angle(self) -> float:
        """Angle of one sector [rad]."""
        return 2 * np.pi / self.n_sectors

    @property
    def diameters(self) -> range:
        """Numbers of nodal diameters the wheel can have, 0 to N / 2."""
        return range(self.n_sectors // 2 + 1)

    @property
    def free(self) -> Index:
        """(f,) independent dofs: neither slaves nor held."""
        return np.setdiff1d(np.arange(self.n), np.union1d(self.slave, self.held))

    @property
    def n_wheel(self) -> int:
        """Number of independent dofs of the whole wheel."""
        return self.n_sectors * self.free.size

    def standing(self, diameter: int) -> bool:
        """True for the harmonics whose waves cannot travel: 0 and N / 2.

        Raises:
            ConfigError: if the wheel cannot have so many diameters.
        """
        return 2 * self.checked(diameter) % self.n_sectors == 0

    def checked(self, diameter: int) -> int:
        """The number of nodal diameters, if the wheel can have it.

        Raises:
            ConfigError: if not.
        """
        most = self.n_sectors // 2
        return whole("diameter", diameter, 0, most, reason="what so many sectors can tell apart")

    def parts(self) -> tuple[csr_matrix, csr_matrix]:
        """Own and next, (n, f) each: u_j = own a_j + next a_(j + step) of independent dofs a."""
        one = identity(self.n, format="csr")
        moves = ~np.isin(self.slave, self.held)
        leading = one[self.master][:, self.free]
        following = csr_matrix(self.coupling)[moves] @ leading
        return one[:, self.free], csr_matrix(one[:, self.slave[moves]] @ following)

    def harmonic(self, diameter: int) -> csr_matrix:
        """(n, f) complex map from independent dofs to all of a sector, u = T a."""
        own, following = self.parts()
        if self.standing(diameter):
            return own + (1.0 if diameter == 0 else -1.0) * following
        return csr_matrix(own + np.exp(1j * diameter * self.step * self.angle) * following)

    def rigid(self, diameter: int) -> Complex:
        """(n, k) rigid motions of the wheel that are waves with these nodal diameters [1, m].

        Motion along and about the axis belongs to 0, motion across it to 1.
        """
        if self.motions is None:
            return np.zeros((self.n, 0), dtype=complex)
        e1 = np.eye(3)[np.argmin(np.abs(self.axis))]
        e1 = unit_vector("axis", np.cross(np.cross(self.axis, e1), self.axis))
        across = e1 + 1j * np.cross(self.axis, e1)
        columns = [
            self.motions[:, 3 * turning : 3 * turning + 3] @ direction
            for n, direction in ((0, self.axis), (1, across), (-1, across.conj()))
            for turning in (0, 1)
            if (diameter - n) % self.n_sectors == 0
        ]
        return np.array(columns, dtype=complex).reshape(-1, self.n).T

    def wheel(self, *others: Matrix) -> tuple[csr_matrix, ...]:
        """K, M and others of the whole wheel, (N f, N f): block j is sector j in its turned axes.

        Others are (n, n) for all sectors alike or lists of N of them.
        """
        own, following = self.parts()
        N = self.n_sectors
        shift = identity(N, format="csr")[np.roll(np.arange(N), -self.step)]
        T = csr_matrix(kron(identity(N), own) + kron(shift, following))

        def assembled(A: Matrix) -> csr_matrix:
            each = A if isinstance(A, list | tuple) else [A] * N
            return csr_matrix(T.T @ block_diag(each, format="csr") @ T)

        return tuple(assembled(A) for A in (self.K, self.M, *others))

    def on_wheel(self, shapes: Complex, diameter: int, phase: float = 0.0) -> Array:
        """(N, n, m) real displacements of all sectors, in axes of the wheel where there are points.

        Mass-normalised shapes of a sector become mass-normalised shapes of the wheel, in units of
        them.

        Args:
            shapes: (n, m) complex displacements of sector 0, in units of any kind.
            diameter: number of nodal diameters.
            phase: turns the wave [rad]; a quarter of 2 pi gives its partner.
        """
        j = np.arange(self.n_sectors)
        wave = np.exp(1j * (diameter * self.angle * j - phase))
        size = np.sqrt((1 if self.standing(diameter) else 2) / self.n_sectors)
        U = size * (wave[:, None, None] * shapes).real
        if self.points is None:
            return U
        turns = np.array([turned(self.axis, k * self.angle) for k in j])
        nodal = U.reshape(self.n_sectors, -1, 3, shapes.shape[1])
        return np.einsum("jab,jpbm->jpam", turns, nodal).reshape(U.shape)


def each_diameter(
    sector: CyclicSector, function: Callable[[int], Value], diameters: Sequence[int] | None = None
) -> list[Value]:
    """Values of a function of each number of nodal diameters, or those given, shared by all ranks.

    The function must not wait for other ranks.
    """
    every = [sector.checked(n) for n in (sector.diameters if diameters is None else diameters)]
    costs = [1.0 if sector.standing(n) else PAIR_COST for n in every]
    return sector.workers.each(function, every, costs)


def region(model: FEModel, name: str) -> tuple[csr_matrix, csr_matrix]:
    """(n, n) stiffness [N/m] and mass [kg] of one region, on every rank."""
    check_known(name, model.regions, f"the sector has no region {name!r}; it has")
    share = model.regions[name]
    return all_rows(model, share.K), all_rows(model, share.M)


def stresses_of(model: FEModel, blade: str | None = None) -> Any:
    """Stress that the finite elements of a model, or of its blade, carry.

    Raises:
        ConfigError: if there are none.
    """
    found = (model if blade is None else model.regions[blade]).stresses
    if found is None:
        raise ConfigError("the model of the blade has no finite elements; see rom.fe.model.")
    refuse_springs(model, "stress of rotation and heat knows elements alone")
    return found


def workers_of(model: FEModel) -> Workers:
    """Who solves with matrices that `all_rows` has given."""
    return ONE_PROCESS if model.operators is None else model.operators.workers


def all_rows(model: FEModel, A: Matrix) -> csr_matrix:
    """A matrix of the model on this process, on all ranks alike, whichever library holds it."""
    return csr_matrix(A if hasattr(A, "tocsr") else model.operators.gathered(A))
