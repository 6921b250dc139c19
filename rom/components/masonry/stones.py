"""Dry masonry: arches and walls of stones that press, rock and slip on each other.

A stone is a polygon with a frame and elastic shapes: three uniform strains, as in discontinuous
deformation analysis, or the modes of a reduced body. `simulate` moves an assembly of stones.
`rom.components.masonry.limits` lays arches and walls, and asks statics what they could carry.

Source:
    After Shi's discontinuous deformation analysis (1988) and its use for masonry by Bagi.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from rom.arguments import one_of
from rom.body.flexible import FlexibleBody
from rom.components.masonry.block_contact import (
    OPEN,
    SLIDES,
    Blocks,
    Contacts,
    Law,
    contacts,
    find_contacts,
)
from rom.components.masonry.discontinuous_deformation import advance, work
from rom.errors import ConfigError, MaterialError, ModelError, SolverError
from rom.model import Array

# distance of corner and edge from which they are watched, of the shortest edge
CONTACT_REACH_RATIO = 0.05
SHEAR_STIFFNESS_RATIO = 1 / 2.5  # stiffness of contacts along the edge over that across it
TENSION_RTOL = 1e-7  # round-off of forces, of the mean weight; much more would glue arches


@dataclass(frozen=True, slots=True)
class Stone:
    """A block.

    Attributes:
        outline: (k, 2) corners at the start, counterclockwise [m].
        centre: (2,) mass centre at the start [m].
        M: (3 + r, 3 + r) mass of translation, rotation about the centre, elastic coordinates [kg,
            kg m^2].
        K: (r, r) stiffness [N/m].
        shapes: (k, 2, r) displacement of the corners per elastic coordinate [m].
    """

    outline: Array
    centre: Array
    M: Array
    K: Array
    shapes: Array


def stone(
    outline: npt.ArrayLike,
    *,
    E: float,
    nu: float,
    rho: float,
    thickness: float = 1.0,
    state: Literal["plane stress", "plane strain"] = "plane stress",
    solid: npt.ArrayLike | None = None,
) -> Stone:
    """A stone with three uniform strains: along x, along y, and shear.

    Args:
        outline: (k, 2) corners, counterclockwise [m].
        E: Young's modulus [Pa].
        nu: Poisson's ratio [1].
        rho: density [kg/m^3].
        thickness: out of the plane [m].
        state: "plane stress" or "plane strain".
        solid: (m, 2) polygon the mass comes from [m], if finer than the outline.

    Raises:
        ConfigError, MaterialError: for an unknown state; if no stone has these numbers.
        ModelError: if the outline does not enclose an area counterclockwise.
    """
    one_of("state", state, ("plane stress", "plane strain"))
    if not (E > 0 and -1 < nu < 0.5 and rho > 0 and thickness > 0):
        raise MaterialError(
            f"no stone has E = {E} Pa, nu = {nu}, rho = {rho} kg/m^3, thickness = {thickness} m.",
            hint="E, rho, thickness > 0; -1 < nu < 0.5.",
        )
    corners = np.asarray(outline, dtype=float)
    area, centre, S = polygon_moments(np.asarray(corners if solid is None else solid, dtype=float))
    if corners.ndim != 2 or len(corners) < 3 or not area > 0:
        raise ModelError(
            f"a stone of {len(corners)} corners encloses {area:.4g} m2.",
            hint="List three corners or more, counterclockwise.",
        )
    Sx, Sy, Sxy = S[0, 0], S[1, 1], S[0, 1]
    M = np.zeros((6, 6))
    M[0, 0] = M[1, 1] = area
    M[2, 2], M[2, 3], M[2, 4], M[2, 5] = Sx + Sy, -Sxy, Sxy, (Sx - Sy) / 2
    M[3, 3], M[4, 4], M[5, 5] = Sx, Sy, (Sx + Sy) / 4
    M[3, 5] = M[4, 5] = Sxy / 2
    M = rho * thickness * (M + np.triu(M, 1).T)
    if state == "plane strain":
        E, nu = E / (1 - nu**2), nu / (1 - nu)
    D = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    X, Y = (corners - centre).T
    shapes = np.array([[X, 0 * X, Y / 2], [0 * X, Y, X / 2]]).transpose(2, 0, 1)
    return Stone(corners, centre, M, area * thickness * D, shapes)


def polygon_moments(x: Array) -> tuple[float, Array, Array]:
    """Area [m^2], centroid (2,) [m] and integral (2, 2) of X X^T about it [m^4] of a polygon."""
    y = np.roll(x, -1, axis=0)
    cross = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
    area = float(cross.sum() / 2)
    centre = (cross[:, None] * (x + y)).sum(axis=0) / (6 * area)
    x, y = x - centre, y - centre
    cross, z = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0], x + y
    S = sum(np.einsum("k,ki,kj->ij", cross / 24, a, a) for a in (x, y, z))
    return area, centre, np.asarray(S)


def reduced_stone(body: FlexibleBody, outline: npt.ArrayLike) -> Stone:
    """A reduced body as a stone in the plane of its x and y axes.

    Args:
        body: the body with its surface, symmetric about the plane.
        outline: (k, 2) corners, counterclockwise, where its surface has nodes [m].

    Raises:
        ModelError: if the outline is not one, or has a corner without a node.
    """
    body, corners = body.with_reference("mean-axis"), np.asarray(outline, dtype=float)
    if body.surface is None or not polygon_moments(corners)[0] > 0:
        raise ModelError(f"body {body.name!r} has no surface, or its outline is not one.")
    points, shape = body.surface.points, body.surface.shape.reshape(-1, 3, body.n_modes)
    far = np.linalg.norm(points[None, :, :2] - corners[:, None], axis=2)
    at = far < 1e-6 * body.size
    if not at.any(axis=1).all():
        k = int(np.argmin(at.any(axis=1)))
        raise ModelError(
            f"no node of body {body.name!r} lies at the corner {corners[k].tolist()}; the nearest "
            f"is {far[k].min():.3g} m away."
        )
    shapes = np.array([shape[nodes, :2].mean(axis=0) for nodes in at])
    centre = body.first_moment[:2] / body.mass
    M = np.diag(np.r_[body.mass, body.mass, 0.0, np.zeros(body.n_modes)])
    M[2, 2] = body.inertia[2, 2] - body.mass * (centre @ centre)
    M[3:, 3:] = body.M
    return Stone(corners, centre, M, body.K, shapes)


@dataclass(frozen=True)
class Masonry:
    """Stones in contact.

    Attributes:
        stones: the stones.
        held: numbers of those that do not move.
        stiffness: of a contact across the edge [N/m]; 10 to 100 times the modulus of the stone
            times its thickness.
        friction: tangent of the angle of friction [1].
        gravity: (2,) [m/s^2].
        reach: distance within which corners watch edges [m]; None for 5 % of the shortest edge.

    Raises:
        ConfigError: if contacts do not press, friction pushes, or a held stone does not exist.
    """

    stones: tuple[Stone, ...]
    held: tuple[int, ...]
    stiffness: float
    friction: float
    gravity: tuple[float, float] = (0.0, -9.81)
    reach: float | None = None

    def __post_init__(self) -> None:
        if not (self.stiffness > 0 and self.friction >= 0):
            raise ConfigError(
                f"stiffness = {self.stiffness} N/m, friction = {self.friction}: needed are > 0, "
                ">= 0."
            )
        if not set(self.held) <= set(range(len(self.stones))):
            raise ConfigError(f"held are {self.held} of the stones 0 to {len(self.stones) - 1}.")

    @property
    def law(self) -> Law:
        """Numbers of the contact law."""
        edges = [np.linalg.norm(s.outline - np.roll(s.outline, 1, axis=0), axis=1).min()
                 for s in self.stones]  # fmt: skip
        weight = np.mean([s.M[0, 0] for s in self.stones]) * np.linalg.norm(self.gravity)
        reach = CONTACT_REACH_RATIO * min(edges) if self.reach is None else self.reach
        p = float(self.stiffness)
        return Law(
            p, SHEAR_STIFFNESS_RATIO * p, float(self.friction), TENSION_RTOL * weight, float(reach)
        )

    def start(self) -> Array:
        """(B, 3 + R) coordinates at the start [m, rad]: mass centre, angle zero, no deformation."""
        q = np.zeros((len(self.stones), 3 + self.R))
        q[:, :2] = [s.centre for s in self.stones]
        return q

    @property
    def R(self) -> int:
        """Largest number of elastic coordinates."""
        return max(len(s.K) for s in self.stones)

    def blocks(self) -> Blocks:
        """The arrays of the kernels; neighbours get neighbouring equations."""
        m, sizes = 3 + self.R, np.array([3 + len(s.K) for s in self.stones])
        first = np.cumsum([0, *(len(s.outline) for s in self.stones)])
        corner, shape = np.zeros((first[-1], 2)), np.zeros((first[-1], 2, self.R))
        M, K, load = (np.zeros((len(sizes), *d)) for d in ((m, m), (m, m), (m,)))
        for b, (s, n) in enumerate(zip(self.stones, sizes, strict=True)):
            corner[first[b] : first[b + 1]] = s.outline - s.centre
            shape[first[b] : first[b + 1], :, : n - 3] = s.shapes
            M[b, :n, :n], K[b, 3:n, 3:n] = s.M, s.K
            load[b, :2] = s.M[0, 0] * np.asarray(self.gravity)
        free = np.ones(len(sizes), dtype=bool)
        free[list(self.held)] = False
        B = Blocks(first, corner, shape, sizes, np.where(free, 0, -1), M, K, load)
        who = _touching(B, self.law, self.start()).who[:, [0, 2]]
        graph = csr_matrix(coo_matrix((np.ones(len(who)), who.T), shape=(len(sizes),) * 2))
        graph = (graph + graph.T)[free][:, free]
        order = np.flatnonzero(free)[reverse_cuthill_mckee(csr_matrix(graph), symmetric_mode=True)]
        equation = np.full(len(sizes), -1)
        equation[order] = np.cumsum([0, *sizes[order]])[:-1]
        return B._replace(equation=equation)


def touching(masonry: Masonry) -> Contacts:
    """Where the stones touch at the start, with gradients of gap and slip."""
    return _touching(masonry.blocks(), masonry.law, masonry.start())


def _touching(B: Blocks, law: Law, q: Array) -> Contacts:
    V, m = len(B.corner), B.load.shape[1]
    C, P, T = contacts(8 * V, m), np.zeros((V, 2)), np.zeros((V, 2, m))
    find_contacts(B, law, q, contacts(0, m), C, P, T)
    rows: list[Any] = [C.used, *(x[: C.used[0]] for x in C[1:])]
    return Contacts(*rows)


@dataclass(frozen=True)
class Motion:
    """Stones in motion.

    Attributes:
        masonry: the stones.
        t: (n,) times [s].
        q, v: (n, B, 3 + R) coordinates and rates: mass centre [m], angle [rad], elastic.
        energy: (n,) kinetic, elastic, potential, and of the contacts [J].
        contacts: those at the end.
        cuts: how often a step was cut.
    """

    masonry: Masonry
    t: Array
    q: Array
    v: Array
    energy: Array
    contacts: Contacts
    cuts: int

    def outlines(self, k: int = -1) -> list[Array]:
        """The (corners, 2) outline of each stone at time k [m]."""
        return [
            x[:2] + (s.outline - s.centre + s.shapes @ x[3 : 3 + len(s.K)]) @ _turned(x[2]).T
            for s, x in zip(self.masonry.stones, self.q[k], strict=True)
        ]

    def stress(self, k: int = -1) -> Array:
        """(B, 3) stress xx, yy, xy in body axes of stones with uniform strain [Pa m], per depth."""
        stones = self.masonry.stones
        areas = [polygon_moments(s.outline)[0] for s in stones]
        found = [s.K @ x[3 : 3 + len(s.K)] for s, x in zip(stones, self.q[k], strict=True)]
        return np.array(found) / np.array(areas)[:, None]

    def joints(self) -> dict[tuple[int, int], tuple[Array, Array]]:
        """For each pair of stones that touch at the end: centre of pressure, force on the first.

        Both (2,) [m], [N]; the centres along an arch are its line of thrust.
        """
        C, law = self.contacts, self.masonry.law
        sums: dict[tuple[int, int], tuple[Array, Array, float]] = {}
        corners = np.vstack(self.outlines())
        for k in range(C.used[0]):
            if C.state[k] == OPEN or C.force[k] <= 0:
                continue
            (i, a, j), normal = C.who[k, :3], C.along[k, 1:3]
            slide = C.way[k] * law.friction * C.force[k]
            drag = slide if C.state[k] == SLIDES else law.shear * C.slip[k]
            force = C.force[k] * normal - drag * np.array([-normal[1], normal[0]])
            x, f, total = sums.get((min(i, j), max(i, j)), (np.zeros(2), np.zeros(2), 0.0))
            sums[min(i, j), max(i, j)] = (
                x + C.force[k] * corners[a], f + (force if i < j else -force), total + C.force[k]
            )  # fmt: skip
        return {pair: (x / total, f) for pair, (x, f, total) in sorted(sums.items())}


def _turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def simulate(
    masonry: Masonry,
    *,
    t_end: float,
    dt: float,
    keep: float = 1.0,
    save_every: int = 1,
    q: npt.ArrayLike | None = None,
    v: npt.ArrayLike | None = None,
) -> Motion:
    """Let the stones move.

    Args:
        masonry: the stones.
        t_end: duration [s].
        dt: step [s]; cut where contacts change too much.
        keep: share of the velocity kept after each step [1]: 1 for dynamics, 0 for statics, 0.95 to
            0.98 to come to rest.
        save_every: steps between two saved ones.
        q: (B, 3 + R) coordinates at the start [m, rad]; None for where the outlines are.
        v: (B, 3 + R) rates at the start [m/s, rad/s]; None for rest.

    Raises:
        ConfigError: if times or shapes do not fit.
        SolverError: if contacts do not settle even in the shortest steps; ``error.solution`` is the
            motion before.
    """
    B, law = masonry.blocks(), masonry.law
    if not (0 < dt < np.inf and abs(t_end) < np.inf):
        raise ConfigError(f"t_end = {t_end} s in steps of dt = {dt} s: both must be positive.")
    n = round(t_end / dt)
    if n < 1 or save_every < 1 or not 0 <= keep <= 1:
        raise ConfigError(f"{n} steps, save_every = {save_every}, keep = {keep}: nothing to do.")
    W, m = work(B), B.load.shape[1]
    for name, given, target in (("q", q, W.q), ("v", v, W.v)):
        x = np.asarray(masonry.start() * (name == "q") if given is None else given, dtype=float)
        if x.shape != target.shape:
            raise ConfigError(f"{name} has the shape {x.shape}; the stones need {target.shape}.")
        target[:] = x
    C, old = (contacts(8 * len(B.corner), m) for _ in range(2))
    cuts, kept = np.zeros(1, dtype=np.int64), [0, *range(save_every, n + 1, save_every)]
    Q, U = np.zeros((2, len(kept), *W.q.shape))
    E = np.full(len(kept), np.nan)
    Q[0], U[0] = W.q, W.v
    for k in range(1, len(kept)):
        E[k] = advance(B, law, C, old, W, dt, save_every, keep, cuts)
        Q[k], U[k] = W.q, W.v
        if not np.isfinite(E[k]):
            raise SolverError(
                f"contacts do not settle near t = {dt * kept[k]:.6g} s, even in steps of "
                f"{dt / 3**8:.2g} s.",
                hint="Use softer contacts, or a smaller dt.",
                solution=Motion(masonry, dt * np.array(kept[:k]), Q[:k], U[:k], E[:k], C,
                                int(cuts[0])),
            )  # fmt: skip
    return Motion(masonry, dt * np.array(kept), Q, U, E, C, int(cuts[0]))
