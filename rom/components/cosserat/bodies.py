"""Rods as bodies of a mechanism, beside reduced solids and rigid bodies.

Frame k carries vertex k and the axes of the segment before it, frame 0 those of the plate at the
start. The plate at the end has a frame of its own, which shares the mass of the last vertex and
its place. Gravity and inertia of a vertex and of a segment are those of its frame; a segment
between two frames and a vertex between two sections are the elements, with the energies of
`rom.components.cosserat.energy`.

Source:
    See docs/theory/rods.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import carray

from rom.components.cosserat.energy import (
    Rod,
    Work,
    curvature_geometry,
    curved,
    stretch_geometry,
    stretched,
)
from rom.components.cosserat.shapes import Shape, reference
from rom.errors import ModelError
from rom.mbs.elements.nonlinear import LAW_MEMORY_SIZE, Elements, Frames, compiled_law
from rom.mbs.kernels.compiled import inner, spliced
from rom.mbs.results.solution import Solution
from rom.model import Array

POSE_SIZE = 13  # numbers of a frame: position, quaternion, velocity, angular velocity
# where the nine dofs of an element are among the twelve of its two frames; tuples would be types of
# their own, for each of which all is compiled
SEGMENT_DOFS = np.array([0, 1, 2, 9, 10, 11, 6, 7, 8])
VERTEX_DOFS = np.array([3, 4, 5, 0, 1, 2, 9, 10, 11])
# inertia that a plate without one takes over from the segment beside it: a trapezoid's share
PLATE_INERTIA_SHARE = 0.25
law_of = cache(compiled_law)


@spliced
def memory(space):
    """Arrays of an element in the memory of the law."""
    R, D = space[0:9].reshape((3, 3)), space[9:36].reshape((3, 9))
    H, unused = space[36:117].reshape((9, 9)), space[127:128]
    a, f, e = space[117:120], space[120:123], space[123:127]
    return Work(R, D, H, a, f, e, unused, unused.reshape((1, 1)))


@inner
def answer_of(W, C, viscous, weight, at, pose, wanted, answer):  # noqa: PLR0913
    """Write energy, lost power, forces and their derivatives of one element."""
    answer[:] = 0.0
    for k in range(3):
        rate = 0.0
        for c in range(9):
            rate += W.D[k, c] * pose[POSE_SIZE * (at[c] // 6) + 7 + at[c] % 6]
        answer[0] += 0.5 * weight * W.f[k] * W.f[k] / C[k]
        answer[1] += weight * viscous[k] * rate * rate
        W.f[k] += viscous[k] * rate
    for c in range(9):
        for k in range(3):
            answer[2 + at[c]] += weight * W.D[k, c] * W.f[k]
    if wanted == 0:
        return
    for c in range(9):
        for d in range(9):
            stiff, damping = W.H[c, d], 0.0
            for k in range(3):
                square = weight * W.D[k, c] * W.D[k, d]
                stiff, damping = stiff + C[k] * square, damping + viscous[k] * square
            answer[14 + 12 * at[c] + at[d]] = stiff
            answer[158 + 12 * at[c] + at[d]] = damping
    for frame in range(2):  # the moment turns with the frame
        for k in range(3):
            c, d = 6 * frame + 3 + (k + 1) % 3, 6 * frame + 3 + (k + 2) % 3
            answer[14 + 12 * c + d] -= 0.5 * answer[2 + 6 * frame + 3 + k]
            answer[14 + 12 * d + c] += 0.5 * answer[2 + 6 * frame + 3 + k]


def segment(numbers, pose, wanted, answer, space):
    """Stretch and shear of a segment: numbers h, C (3), viscous (3), a0 (3)."""
    given, poses = carray(numbers, (10,)), carray(pose, (2 * POSE_SIZE,))
    W = memory(carray(space, (LAW_MEMORY_SIZE,)))
    h, C = given[0], given[1:4]
    stretched(h, C, given[7:10], poses[0:3], poses[13:16], poses[16:20], W)
    if wanted:
        stretch_geometry(h, W)
    result = carray(answer, (302,))
    answer_of(W, C, given[4:7], h, SEGMENT_DOFS, poses, wanted, result)


def vertex(numbers, pose, wanted, answer, space):
    """Bending and twist of a vertex: numbers l, B (3), viscous (3), s (4), S (9)."""
    given, poses = carray(numbers, (20,)), carray(pose, (2 * POSE_SIZE,))
    W = memory(carray(space, (LAW_MEMORY_SIZE,)))
    B, S = given[1:4], given[11:20].reshape((3, 3))
    curved(given[0], B, given[7:11], S, poses[3:7], poses[16:20], W)
    if wanted:
        curvature_geometry(S, W)
    result = carray(answer, (302,))
    answer_of(W, B, given[4:7], given[0], VERTEX_DOFS, poses, wanted, result)


@dataclass(frozen=True)
class RodBody:
    """A rod for `rom.Mechanism.add_nonlinear`, see `body`.

    Attributes:
        rod: the rod.
        frames: (N + 2) frames.
        elements: its segments and its vertices.
    """

    rod: Rod
    frames: Frames
    elements: tuple[Elements, ...]

    @property
    def places(self) -> Mapping[str, int]:
        """The plates at the ends."""
        return {"start": 0, "end": len(self.frames.x) - 1}

    @property
    def coincident(self) -> tuple[tuple[int, int]]:
        """The last vertex and the plate at the end."""
        n = len(self.frames.x)
        return ((n - 2, n - 1),)


def body(rod: Rod, start: Shape | None = None) -> RodBody:
    """A rod as a body of a mechanism, with markers "start" and "end" at its plates.

    A plate without inertia takes a quarter of that of the segment beside it; the sum stays. The
    mechanism is put together in the shape ``start``; None for the one without stress.

    Raises:
        ModelError: if the rod has no mass or no inertia.
    """
    shape = reference(rod) if start is None else start
    if rod.mass.min() <= 0.0 or rod.inertia[1:-1].min() <= 0.0:
        text = "a rod without mass or inertia cannot move in a mechanism"
        raise ModelError(f"{text}; give rod(...) both of its sections.")
    mass = np.append(rod.mass, 0.5 * rod.mass[-1])
    mass[-2] *= 0.5
    frames = Frames(np.vstack([shape.x, shape.x[-1:]]), shape.p.copy(), mass, _inertia(rod))
    n = rod.h.size
    pairs = np.column_stack([np.arange(n + 1), np.arange(1, n + 2)])
    stretch = np.column_stack([rod.h, rod.stretch, rod.viscous_stretch, rod.a0])
    bend = np.column_stack([rod.l, rod.bend, rod.viscous_bend, rod.s, rod.S.reshape(n + 1, 9)])
    by_rate = bool(rod.viscous_stretch.any() or rod.viscous_bend.any())
    along = (
        Elements.of(law_of(segment), pairs[:-1], stretch, by_rate=by_rate),
        Elements.of(law_of(vertex), pairs, bend, by_rate=by_rate),
    )
    return RodBody(rod, frames, along)


def _inertia(rod: Rod) -> Array:
    """(N + 2, 3) inertia of plate, segments, plate, none without."""
    J = rod.inertia.copy()
    for plate, beside in ((0, 1), (-1, -2)):
        if (J[plate] <= 0.0).any():
            moved = PLATE_INERTIA_SHARE * rod.inertia[beside]
            J[plate] += moved
            J[beside] -= moved
    return J


def shape_of(solution: Solution, name: str, k: int = -1) -> Shape:
    """Shape of a rod of a mechanism at the saved instant k, in the world."""
    parts = solution.mechanism.nonlinear[name].parts
    B = solution.packed.system.bodies
    number = [solution.packed.names.index(part.name) for part in parts]
    q = np.array([solution.q[k, B.q_at[b] : B.q_at[b] + 7] for b in number])
    return Shape(q[:-1, :3].copy(), q[:, 3:].copy())
