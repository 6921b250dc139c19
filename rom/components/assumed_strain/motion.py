"""Forces, stiffness and mass of a sheet, and explicit motion.

Source:
    Flores, A two-dimensional linear assumed strain triangular element for finite deformation
    analysis, J. Appl. Mech. 73 (2006) 970.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix, identity, kron

from rom.arguments import Count, Positive, between, finite, not_negative, positive, shortened, typed
from rom.components.assumed_strain import kernels
from rom.components.assumed_strain.actions import Actions, dofs_of, nodal, prepared
from rom.components.assumed_strain.triangles import (
    STATES,
    Sheet,
    constant_gradients,
    each_side,
    placed,
)
from rom.errors import ConfigError, MaterialError, SolverError
from rom.model import Array, Index


@dataclass(frozen=True, slots=True)
class Metal:
    """Elastic-plastic solid: Hencky elasticity in ln U, or linear in the Green-Lagrange strain.

    Attributes:
        E: Young's modulus [Pa].
        nu: Poisson's ratio [1].
        rho: density [kg/m^3].
        yield_stress: first yield stress [Pa].
        hardening: slope of the yield stress over plastic strain [Pa].
        linear: St. Venant and Kirchhoff's law S = D E in place of Hencky's; never yields.

    Raises:
        MaterialError: if no solid has these numbers.
    """

    E: float
    nu: float
    rho: float = 1.0
    yield_stress: float = np.inf
    hardening: float = 0.0
    linear: bool = False

    def __post_init__(self) -> None:
        positive("E", self.E, error=MaterialError)
        between("nu", self.nu, -1.0, 0.5, "()", error=MaterialError)
        positive("rho", self.rho, error=MaterialError)
        positive("yield_stress", self.yield_stress, error=MaterialError, infinite=True)
        not_negative("hardening", self.hardening, error=MaterialError)
        if not isinstance(self.linear, bool):
            raise MaterialError(f"linear = {shortened(self.linear)} must be True or False.")

    @property
    def numbers(self) -> Array:
        """(5,) bulk modulus, shear modulus, yield stress, hardening [Pa]; 1 for the linear law."""
        K, mu = self.E / (3 * (1 - 2 * self.nu)), self.E / (2 * (1 + self.nu))
        return np.array([K, mu, self.yield_stress, self.hardening, float(self.linear)])

    @property
    def wave_speed(self) -> float:
        """Fastest elastic wave [m/s]."""
        K, mu = self.numbers[:2]
        return float(np.sqrt((K + 4 / 3 * mu) / self.rho))


@typed
def tangent(body: Sheet, metal: Metal, x: Array, history: Array | None = None) -> csr_matrix:
    """(2n, 2n) tangent stiffness [N/m], where the positions began the linear one.

    At positions x (n, 2) [m] and a history (t, p, 5) as of `forces` [1]; None: virgin.

    Raises:
        ConfigError: if positions or history do not fit the sheet.
    """
    K, x = np.zeros((len(body.patch), 12, 12)), nodal("positions", x, body)
    kernels.tangents(x, *_parts(body, metal, history), K)
    dofs = (2 * body.patch[:, :, None] + np.arange(2)).reshape(-1, 12)
    return placed(0.5 * (K + np.swapaxes(K, 1, 2)), dofs, dofs, 2 * len(x))


@typed
def forces(
    body: Sheet, metal: Metal, x: Array, history: Array | None = None
) -> tuple[Array, Array]:
    """(n, 2) internal forces [N] at a position, and the history after it.

    Positions x are (n, 2) [m], a history (t, p, 5) plastic strain 11, 22, 12, 33 and the
    accumulated one [1]; None: virgin.

    Raises:
        ConfigError: if positions or history do not fit the sheet.
    """
    f, parts = np.zeros(body.points.shape), _parts(body, metal, history)
    new = np.empty_like(parts[-1])
    kernels.forces(nodal("positions", x, body), *parts, f, new)
    return f, new


@typed
def mass(body: Sheet, metal: Metal) -> csr_matrix:
    """(2n, 2n) consistent mass [kg]; lumped by its row sums in `fly`."""
    m, T = body.weights.sum(axis=1) * metal.rho / 12, body.triangles
    each = m[:, None, None] * (1 + np.eye(3))
    return kron(placed(each, T, T, len(body.points)), identity(2), "csr")


@dataclass(frozen=True, slots=True)
class Flight:
    """What happened, picture by picture.

    Attributes:
        t: (k,) times [s].
        x: (k, n, 2) positions [m].
        plastic: (k, t, p) accumulated plastic strain [1].
        work: energy that went from motion, loads and tools into the solid [J].
        steps: number of time steps; -1 of a motion that was lost.
        tool_forces: (k, tools, 2) mean forces of the tools on the sheet since the last picture [N].
        reactions: (k, n, 2) inner forces less loads, of driven nodes with their inertia: what
            supports and drives give [N].
    """

    t: Array
    x: Array
    plastic: Array
    work: float
    steps: int
    tool_forces: Array
    reactions: Array


@typed
def fly(
    body: Sheet,
    metal: Metal,
    v: Array,
    held: npt.ArrayLike,
    t_end: Annotated[float, Positive("s")],
    *,
    pictures: Annotated[int, Count(2)] = 41,
    actions: Actions | None = None,
) -> Flight:
    """Explicit motion from rest lengths.

    Nodes that come into a tool are put back onto its face, by an impulse with Coulomb's friction.

    Args:
        body: the sheet.
        metal: its material.
        v: (n, 2) velocities at the start [m/s].
        held: (k,) dof numbers that do not move, beside those of the actions.
        t_end: duration [s].
        pictures: number of instants that are kept.
        actions: loads, pressure, driven nodes and tools.

    Raises:
        ConfigError: if velocities, held dofs or actions do not fit.
        MeshError: if a tool begins inside the sheet.
        SolverError: if the motion is lost; ``error.solution`` holds the pictures before.
    """
    v, actions = nodal("velocities", v, body), actions or Actions()
    held = np.union1d(dofs_of(held, body), dofs_of(actions.held, body))
    acts = prepared(body, replace(actions, held=held), (0.0, t_end))
    lumped = np.asarray(mass(body, metal).sum(axis=1)).ravel()[::2]
    free, x, parts = np.ones(v.shape, dtype=bool), body.points.copy(), _parts(body, metal, None)
    free.reshape(-1)[acts.driven] = False
    shapes = x.shape, body.weights.shape, (len(acts.friction), 2), x.shape
    t, seen = np.linspace(0, t_end, pictures), [np.zeros((pictures, *shape)) for shape in shapes]
    seen[0][:] = np.nan
    acting = acts.times, acts.table, acts.forces, depth_of(body), acts.driven, acts.columns
    tools, histories = (acts.faces, acts.first, acts.friction), (parts[6], parts[6].copy())
    solid = (*parts[:4], body.area), *parts[4:6], metal.wave_speed
    start = x, np.where(free, v, 0.0), lumped, free
    steps, work = kernels.fly(*start, *solid, (*acting, tools), t, histories, tuple(seen))
    path, plastic = seen[:2]
    if steps < 0 or not np.isfinite(path).all():
        k = int(np.append(np.isfinite(path).all(axis=(1, 2)), False).argmin())
        raise SolverError(
            "the explicit motion was lost.",
            hint="Use the element F1, or finer time.",
            solution=Flight(t[:k], path[:k], plastic[:k], work, steps, *(x[:k] for x in seen[2:])),
        )
    return Flight(t, path, plastic, work, steps, *seen[2:])


def depth_of(body: Sheet) -> float:
    """Thickness of a plane solid [m]; -1 with axial symmetry."""
    return -1.0 if body.state == "axisymmetric" else body.thickness


Parts = tuple[Index, Array, Array, Array, Array, int, Array]


def _parts(body: Sheet, metal: Metal, history: Array | None) -> Parts:
    """Arguments of the kernels between positions and results."""
    shape = (*body.weights.shape, 5)
    history = np.zeros(shape) if history is None else finite("history", history, shape)
    numbers, state = metal.numbers, STATES[body.state]
    return body.patch, body.gradients, body.weights, body.radius, numbers, state, history


@typed
def stiffness_by_sides(body: Sheet, metal: Metal, *, share: tuple[int, int] = (0, 1)) -> csr_matrix:
    """(2n, 2n) linear stiffness of the element "F3" where the sheet began [N/m].

    K = sum over sides of V/3 B^T D B, V the volume of the triangles at the side. Its gradient is
    theirs, averaged by area: the same as that of the four nodes in a patch. A side needs nothing
    but its triangles, so that processes can share the sides; their matrices add up to K.

    The sheet is plane, of its points and triangles, not of its element; a share is (number of this
    process, number of processes).

    Raises:
        ConfigError: with axial symmetry, or for a share that does not exist.
        MeshError: if a triangle is turned over.

    Source:
        Edge-based smoothed elements: Liu, Nguyen-Thoi and Lam, J. Sound Vib. 320 (2009) 1100.
    """
    mine, of = share
    if not 0 <= mine < of or body.state == "axisymmetric":
        raise ConfigError(f"share {mine} of {of}, {body.state}: needed is a share of a plane one.")
    _, _, places, inner = each_side(body.triangles)
    triangles = places[mine::of] % len(body.triangles)
    G, area = constant_gradients(body.points, body.triangles)
    parts = area[triangles]
    parts[~inner[mine::of], 1] = 0.0  # at an edge there is but one
    whole = parts.sum(axis=1)
    gradient = (parts / whole[:, None])[..., None, None] * G[triangles, :3]
    B = _strains(gradient.reshape(-1, 6, 2))
    volume = whole / 3 * body.thickness
    K = np.swapaxes(B, 1, 2) @ (volume[:, None, None] * (_elasticity(body, metal) @ B))
    nodes = body.triangles[triangles].reshape(-1, 6)  # some twice: their entries add up
    dofs = (2 * nodes[:, :, None] + np.arange(2)).reshape(-1, 12)
    return placed(K, dofs, dofs, 2 * len(body.points))


def _strains(gradient: Array) -> Array:
    """B (m, 3, 12) from gradients (m, 6, 2): strains along both axes, and the shear angle."""
    B = np.zeros((len(gradient), 3, 12))
    B[:, 0, ::2] = B[:, 2, 1::2] = gradient[..., 0]
    B[:, 1, 1::2] = B[:, 2, ::2] = gradient[..., 1]
    return B


def _elasticity(body: Sheet, metal: Metal) -> Array:
    """(3, 3) Hooke's law in the plane [Pa]."""
    E, nu = metal.E, metal.nu
    if body.state == "plane strain":
        E, nu = E / (1 - nu**2), nu / (1 - nu)
    return E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
