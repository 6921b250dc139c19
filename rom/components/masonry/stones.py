"""Dry masonry: arches and walls of stones that press, rock and slip on each other.

A stone is a polygon with a frame and elastic shapes: three uniform strains, as in discontinuous
deformation analysis, or the modes of a reduced body.

Source:
    After Shi's discontinuous deformation analysis (1988) and its use for masonry by Bagi.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from rom.arguments import Between, Length, NotNegative, Positive, check_places, finite, typed
from rom.body.flexible import FlexibleBody
from rom.body.surface import surface_of
from rom.components.masonry.block_contact import (
    Blocks,
    Bonds,
    Contacts,
    Law,
    contacts,
    find_contacts,
)
from rom.components.masonry.joints import Joint, bonds, friction_of_pairs
from rom.errors import ConfigError, MaterialError, ModelError
from rom.model import Array, Index

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


@typed
def stone(
    outline: npt.ArrayLike,
    *,
    E: Annotated[float, Positive("Pa", error=MaterialError)],
    nu: Annotated[float, Between(-1.0, 0.5, "()", error=MaterialError)],
    rho: Annotated[float, Positive("kg/m^3", error=MaterialError)],
    thickness: Annotated[float, Positive("m", error=MaterialError)] = 1.0,
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
        ModelError: if the outline does not enclose an area counterclockwise.
    """
    corners = _corners(outline)
    area, centre, S = polygon_moments(corners if solid is None else _corners(solid))
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


def _corners(outline: npt.ArrayLike) -> Array:
    """(k, 2) corners of a polygon that encloses an area, counterclockwise."""
    x = finite("the outline of a stone", outline, (None, 2), error=ModelError)
    y = np.roll(x, -1, axis=0)
    sides = np.linalg.norm(y - x, axis=1)
    if len(x) > 2 and not sides.all():
        raise ModelError(f"corner {int(sides.argmin())} is listed twice in turn; leave one out.")
    area = float((x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum() / 2)
    if not area > 0:
        text = f"an outline of {len(x)} corners encloses {area:.4g} m2"
        raise ModelError(f"{text}; list at least three corners, counterclockwise.")
    return x


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


@typed
def reduced_stone(body: FlexibleBody, outline: npt.ArrayLike) -> Stone:
    """A reduced body as a stone in the plane of its x and y axes.

    The body has its surface, symmetric about the plane, with nodes at the corners of the outline
    (k, 2), counterclockwise [m].

    Raises:
        ModelError: if the outline is not one, or has a corner without a node.
    """
    body, corners = body.with_reference("mean-axis"), _corners(outline)
    surface = surface_of(body)
    points, shape = surface.points, surface.shape.reshape(-1, 3, body.n_modes)
    far = np.linalg.norm(points[None, :, :2] - corners[:, None], axis=2)
    at = far < 1e-6 * body.size
    if not at.any(axis=1).all():
        k = int(np.argmin(at.any(axis=1)))
        text = f"no node of body {body.name!r} lies at the corner {corners[k].tolist()}; one"
        raise ModelError(f"{text} is {far[k].min():.3g} m away. Give outlines through nodes.")
    shapes = np.array([shape[nodes, :2].mean(axis=0) for nodes in at])
    centre = body.first_moment[:2] / body.mass
    M = np.diag(np.r_[body.mass, body.mass, 0.0, np.zeros(body.n_modes)])
    M[2, 2] = body.inertia[2, 2] - body.mass * (centre @ centre)
    M[3:, 3:] = body.M
    return Stone(corners, centre, M, body.K, shapes)


@typed
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
        joints: laws of joints where they are not just friction; the last that fits a joint counts.
        thickness: out of the plane [m], for strengths of joints and pressure of wind.

    Raises:
        ConfigError: without a stone that can move; if contacts do not press, friction pushes, or a
            held stone does not exist; if a joint is between stones that do not exist, or glued
            where they do not touch; for a reach or gravity that is none.
    """

    stones: tuple[Stone, ...]
    held: tuple[int, ...]
    stiffness: Annotated[float, Positive("N/m")]
    friction: Annotated[float, NotNegative()]
    gravity: tuple[float, float] = (0.0, -9.81)
    reach: Length | None = None
    joints: tuple[Joint, ...] = ()
    thickness: Length = 1.0

    def __post_init__(self) -> None:
        check_places("held: stone", self.held, len(self.stones))
        if len(set(self.held)) == len(self.stones):
            raise ConfigError(f"all of {len(self.stones)} stones are held; leave one free to move.")

    @property
    def law(self) -> Law:
        """Numbers of the contact law, and the bonds of joints with strength, all intact."""
        law = self._watch()
        if not any(joint.cohesion or joint.tension for joint in self.joints):
            return law
        C, corners = touching(self), np.vstack([s.outline for s in self.stones])
        b = bonds(self.joints, C, corners, len(self.stones), law.reach)
        t = self.thickness
        return law._replace(bonds=b._replace(pull=t * b.pull, cohesion=t * b.cohesion))

    def _watch(self) -> Law:
        sides = (s.outline - np.roll(s.outline, 1, axis=0) for s in self.stones)
        edges = [np.linalg.norm(along, axis=1).min() for along in sides]
        weight = np.mean([s.M[0, 0] for s in self.stones]) * np.linalg.norm(self.gravity)
        reach = CONTACT_REACH_RATIO * min(edges) if self.reach is None else self.reach
        p, free = float(self.stiffness), np.zeros(0)
        friction = friction_of_pairs(self.joints, self.friction, len(self.stones))
        none = Bonds(np.zeros((0, 5), dtype=np.int64), free, free, free.astype(np.int64))
        tension = TENSION_RTOL * weight
        return Law(p, SHEAR_STIFFNESS_RATIO * p, tension, float(reach), friction, none)

    def start(self) -> Array:
        """(B, 3 + R) coordinates at the start [m, rad]: mass centre, angle zero, no deformation."""
        q = np.zeros((len(self.stones), 3 + self.R))
        q[:, :2] = [s.centre for s in self.stones]
        return q

    def first_corners(self) -> Index:
        """(B + 1,) number of the first corner of each stone, and of all corners."""
        return np.cumsum([0, *(len(s.outline) for s in self.stones)])

    @property
    def R(self) -> int:
        """Largest number of elastic coordinates."""
        return max(len(s.K) for s in self.stones)

    def blocks(self) -> Blocks:
        """The arrays of the kernels; neighbours get neighbouring equations."""
        m, sizes = 3 + self.R, np.array([3 + len(s.K) for s in self.stones])
        first = self.first_corners()
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
        who = _touching(B, self._watch(), self.start()).who[:, [0, 2]]
        graph = csr_matrix(coo_matrix((np.ones(len(who)), who.T), shape=(len(sizes),) * 2))
        graph = (graph + graph.T)[free][:, free]
        order = np.flatnonzero(free)[reverse_cuthill_mckee(csr_matrix(graph), symmetric_mode=True)]
        equation = np.full(len(sizes), -1)
        equation[order] = np.cumsum([0, *sizes[order]])[:-1]
        return B._replace(equation=equation)


def touching(masonry: Masonry) -> Contacts:
    """Where the stones touch at the start, with gradients of gap and slip."""
    return _touching(masonry.blocks(), masonry._watch(), masonry.start())


def _touching(B: Blocks, law: Law, q: Array) -> Contacts:
    V, m = len(B.corner), B.load.shape[1]
    C, none = (contacts(room, m, len(B.size)) for room in (8 * V, 0))
    find_contacts(B, law, q, none, C, np.zeros((V, 2)), np.zeros((V, 2, m)))
    return C._replace(**{name: getattr(C, name)[: C.used[0]] for name in C._fields[1:-2]})
