"""Component mode synthesis of one sector, good for all nodal diameters at once."""

from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import chain

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix, identity
from scipy.spatial import cKDTree

from rom.arguments import typed
from rom.checks.draft import Draft, run
from rom.components.wheels.modes import cyclic_modes, wheel_modes
from rom.components.wheels.sector import NO_DOFS, Complex, CyclicSector, Matrix, each_diameter
from rom.eigen.verbs import DEPENDENT_RTOL, every_row, orthonormal_in, own_rows, static_shapes
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, Basis, Index, Interface, Report, Row
from rom.names import check_all_known
from rom.reduction.bases.method import CraigBampton
from rom.reduction.interfaces.polynomial import FourierLegendre, Polynomial
from rom.rows import FREQUENCY_RTOL, N_COMPARED, frequency_rows

Functions = Polynomial | FourierLegendre
CYCLIC_FACES = "cyclic"  # what the faces are called where sectors of a wheel meet


@dataclass(frozen=True)
class ReducedSector(CyclicSector):
    """A sector in a few coordinates: those of its two faces, then fixed-interface modes.

    Attributes:
        Psi: (n_full, r) displacement shapes of the full sector [1; kg^-1/2].
        full: the full sector.
        omega: (m,) circular frequencies of the fixed-interface modes [rad/s].
    """

    Psi: Array | None = None
    full: CyclicSector | None = None
    omega: Array | None = None

    @property
    def supported(self) -> bool:
        """True when something of the full sector is held."""
        return self.full.supported

    @cached_property
    def certificate(self) -> Report:
        """Frequencies against the full sector, which is solved when this is first asked for."""
        return sector_certificate(self, self.full)

    def expand(self, shapes: Complex) -> Complex:
        """(n_full, m) displacements of the full sector, in units of the shapes (r, m) given."""
        return self.Psi @ shapes

    def on_wheel(self, shapes: Complex, diameter: int, phase: float = 0.0) -> Array:
        """(N, n_full, m) real displacements of the full sectors, see `CyclicSector.on_wheel`."""
        return self.full.on_wheel(self.expand(shapes), diameter, phase)


@typed
def reduce_sector(
    sector: CyclicSector,
    *,
    n_modes: int | None = None,
    functions: Functions | None = None,
    method: CraigBampton | None = None,
) -> ReducedSector:
    """Craig-Bampton reduction of a sector with a-priori functions on its cyclic faces.

    The faces follow u_master = (Q (x) I) a and u_slave = C (Q (x) I) b with functions Q that are
    chosen before anything is solved; both faces take the same, so that sectors stay joined exactly
    and a and b are again dofs of a sector whose faces match: `cyclic_modes` and the others take it
    like any sector. Frequencies are never below those of the full sector.

    Args:
        sector: the full sector, made by `CyclicSector.from_model`.
        n_modes: number of fixed-interface modes; or `method`.
        functions: on the cyclic faces; `Polynomial` of order 4 unless given. Where the face is
            held they fall to zero, see `fading`. Order 7 with 60 modes brings the ten lowest
            frequencies of each nodal diameter of a bladed disk within 0.1 %.
        method: ``CraigBampton(n_modes)`` instead of the number.

    Raises:
        ConfigError: if the sector has no geometry of its faces, or cannot have so many modes.
        InterfaceError: if the functions cannot move the face.

    Source:
        Carassale and Maurici, Interface reduction in Craig-Bampton component mode synthesis by
        orthogonal polynomial series, J. Eng. Gas Turbines Power 140 (2018); on cyclic faces ours.
    """
    if (n_modes is None) == (method is None) or (method and method.n_modes is None):
        text = f"a sector needs a number of fixed-interface modes, not {n_modes}, {method!r}."
        raise ConfigError(text, hint="Write n_modes=60, or method=rom.CraigBampton(n_modes=60).")
    if sector.face is None:
        raise ConfigError("a sector without cyclic faces has no geometry: CyclicSector.from_model.")
    faces = {CYCLIC_FACES: functions or Polynomial(4)}
    draft = SectorDraft(model=sector, method=method or CraigBampton(n_modes), interfaces=faces)
    return run((connect_faces, basis, project), draft)


@dataclass(kw_only=True)
class SectorDraft(Draft):
    """The reduction of a sector under way, whose faces, and where it is cut, follow functions."""

    root: tuple[Index, Array] | None = None  # (3 k,) dofs of a further cut, (k, m) functions on it
    parts: tuple[tuple[Index, int], ...] = ()  # (held dofs, number of modes) of each; one if empty
    moved: Array = field(init=False)  # (n, c) unit motions of the cuts, zero on all other dofs
    held: Index = field(init=False)  # dofs of the cuts, and those that do not move at all
    q: int = field(init=False)  # number of coordinates of either face


def connect_faces(draft: SectorDraft) -> None:
    """Let both cyclic faces follow the same functions."""
    sector = draft.model
    W = np.kron(face_functions(sector, draft.interfaces[CYCLIC_FACES]), np.eye(3))
    draft.q = q = W.shape[1]
    draft.moved = np.zeros((sector.n, 2 * q))
    draft.moved[sector.master, :q] = W
    draft.moved[sector.slave, q:] = sector.coupling @ W
    draft.moved[sector.held] = 0.0
    draft.held = np.union1d(np.union1d(sector.slave, sector.master), sector.held)
    draft.ops = sector.workers.operators(sector.K, sector.M, together=True)


def connect_root(draft: SectorDraft) -> None:
    """Let what is cut off follow functions where it is cut."""
    dofs, Q = draft.root
    moved = np.zeros((draft.model.n, 3 * Q.shape[1]))
    moved[dofs] = np.kron(Q, np.eye(3))
    moved[draft.model.held] = 0.0
    draft.moved, draft.held = np.hstack([draft.moved, moved]), np.union1d(draft.held, dofs)


def basis(draft: SectorDraft) -> None:
    """Find modes of the parts, and static answers to the motions of the cuts."""
    ops, inner = draft.ops, draft.ops.hold(draft.held)
    parts = draft.parts or ((inner, draft.method.n_modes),)
    modes = [ops.modes(held, n) for held, n in parts]  # then solutions with the same factor
    static = static_shapes(ops, inner, own_rows(ops, draft.moved))
    Psi = every_row(ops, np.hstack([static, *(Phi for _, Phi in modes)]))
    draft.basis = Basis(Psi, modes[0][0], ())


def project(draft: SectorDraft) -> None:
    """Write the sector in the coordinates of its basis."""
    draft.body = projected(draft.model, draft.basis.Psi, draft.q, draft.basis.omega)


def reduced_by(
    sector: CyclicSector, method: CraigBampton, interfaces: dict[str, Functions], *, of_bodies: bool
) -> ReducedSector:
    """A sector by what is given to `rom.reduce`: a method and the functions on its cyclic faces."""
    if of_bodies:
        text = "reference, damping, stress, stiffening and nonlinear belong to bodies in motion."
        raise ConfigError(text, hint="Let a sector turn by rom.rotating_sector.")
    check_all_known(interfaces, [CYCLIC_FACES], "a sector has no interface")
    return reduce_sector(sector, method=method, functions=interfaces.get(CYCLIC_FACES))


def projected(sector: CyclicSector, Psi: Array, q: int, omega: Array) -> ReducedSector:
    """The sector in the coordinates of Psi, the first q of them one face, the next q the other."""

    def small(A: Matrix) -> csr_matrix:
        return None if A is None else csr_matrix(Psi.T @ (A @ Psi))

    K, M = (0.5 * (A + A.T) for A in (small(sector.K), small(sector.M)))
    kept = {f.name: getattr(sector, f.name) for f in fields(CyclicSector)}
    if (motions := sector.motions) is not None:
        motions = np.linalg.solve(M.toarray(), Psi.T @ (sector.M @ motions))
    regions = {name: small(A) for name, A in sector.regions.items()}
    kept |= {"K": K, "M": M, "motions": motions, "points": None, "face": None, "regions": regions}
    kept |= {"slave": np.arange(q, 2 * q), "master": np.arange(q), "held": NO_DOFS}
    kept |= {"coupling": identity(q, format="csr")}
    kept |= {name: small(getattr(sector, name)) for name in ("coriolis", "centrifugal")}
    return ReducedSector(**kept, Psi=Psi, full=sector, omega=omega)


def face_functions(sector: CyclicSector, functions: Functions) -> Array:
    """(k, m) functions on the leading face, orthonormal over its area, zero where it is held."""
    face: Interface = sector.face
    V, S = functions.functions(face), face.surface_mass
    at_rest = np.isin(face.dofs[::3], sector.held)
    if at_rest.all():
        text = f"all nodes of the cyclic face {face.name!r} are held"
        raise InterfaceError(f"{text}; hold another interface.")
    if at_rest.any():
        V = V * fading(face, at_rest)[:, None]
    norms = np.sqrt(np.einsum("km,km->m", V, S @ V))
    return orthonormal_in(S, V[:, norms > DEPENDENT_RTOL * norms.max()])


def fading(face: Interface, at_rest: npt.NDArray[np.bool_]) -> Array:
    """(k,) factor d / (d + l) that grows from 0 at what is held to 1, d the distance from it [m].

    What a clamped edge disturbs dies out within the thickness of the face (Saint-Venant); l is
    half of it. Polynomials times d alone need high orders to rise as steeply as the motion does.
    """
    d = distance(face.points, face.points[at_rest])
    weights = np.asarray(face.surface_mass.sum(axis=1)).ravel() / face.area
    x = face.points - weights @ face.points
    across = np.linalg.eigvalsh((weights[:, None] * x).T @ x)[1]  # of a strip, thickness^2 / 12
    return d / (d + np.sqrt(3 * across))


def distance(points: Array, line: Array) -> Array:
    """(k,) distance from the segments between neighbours among scattered nodes of a line."""
    near = cKDTree(line).query(points, list(range(1, min(3, len(line)) + 1)))[1]
    first = line[near[:, 0]]
    arm, found = points - first, np.linalg.norm(points - first, axis=1)
    for other in near.T[1:]:
        edge = line[other] - first
        share = np.einsum("ka,ka->k", arm, edge) / np.einsum("ka,ka->k", edge, edge)
        beside = arm - np.clip(share, 0.0, 1.0)[:, None] * edge
        found = np.minimum(found, np.linalg.norm(beside, axis=1))
    return found


N_FAMILIES = 2  # modes per number of nodal diameters, whose union is compared with a wheel


def sector_certificate(small: CyclicSector, full: CyclicSector) -> Report:
    """Frequencies of a reduced sector against the full one, for a few numbers of diameters."""
    diameters = list(small.diameters)
    chosen = sorted({0, 1, len(diameters) // 2, diameters[-1]} & set(diameters))

    def rows(d: int) -> list[Row]:
        n = min(N_COMPARED, small.harmonic(d).shape[1])
        reduced, exact = (cyclic_modes(sector, d, n).frequencies for sector in (small, full))
        return _rows(f"{d} nodal diameters", reduced, exact)

    found = each_diameter(full, rows, chosen)
    return Report("certificate of the sector", tuple(chain.from_iterable(found)))


def rows_of_wheel(what: str, found: Array, sector: CyclicSector, speed: float = 0.0) -> list[Row]:
    """The lowest frequencies of a wheel against the union of those of its sector."""
    exact, complete = [], np.inf
    for modes in wheel_modes(sector, N_FAMILIES, speed=speed):
        exact += [*modes.frequencies] * modes.multiplicity
        complete = min(complete, modes.frequencies[-1])  # above it some diameters miss theirs
    union = np.sort([f for f in exact if f <= complete * (1 + FREQUENCY_RTOL)])
    return _rows(what, found[: union.size], union)


def _rows(what: str, reduced: Array, exact: Array) -> list[Row]:
    """Elastic frequencies compared; rigid motions are zero in both."""
    elastic = exact > 0
    table = {"reduced": reduced[elastic].tolist(), "full": exact[elastic].tolist()}
    return frequency_rows(what, table) if elastic.any() else []
