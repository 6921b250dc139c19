"""Non-linear flexible bodies in a mechanism: frames with inertia, and laws between them.

What such a body tells: frames (position, axes, lumped mass and inertia), elements with their laws,
places for markers, and which frames share their origin. Each frame becomes a body of the mechanism
with the same joints, forces, statics and linearisation as others have; the elimination goes along
them, at a cost that grows with their number only.

The law of an element of k frames is a compiled function of C,

``void law(const double *numbers, const double *pose, int64 wanted, double *answer, double *space)``

with ``pose`` (k, 13): position (3) [m] and velocity of the origin in the world, quaternion and
angular velocity in the axes of the frame, in the order of position, quaternion, velocity, angular
velocity. It writes, with n = 6 k and the rows force in the world, moment in the frame: stored
energy [J]; lost power [W]; (n,) forces of energy and damping that resist the motion; and, if
``wanted`` is not zero, (n, n) their derivative by displacements in the world and rotations in the
frame; (n, n) their derivative by the velocities. ``space`` is memory for LAW_MEMORY_SIZE numbers.
Such a function is made with ``numba.cfunc`` or by any compiler; `compiled_law` keeps what it makes.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numba import types
from numba.extending import intrinsic

from rom import rotation
from rom.arguments import Omega, Orientation, Point, Velocity, finite, start_pose, typed, whole
from rom.errors import ConfigError, ModelError
from rom.mbs.compiler.calls import called
from rom.mbs.elements.family import Family, Hooks, Places, integers, on_joint
from rom.mbs.elements.law_calls import compiled_entry
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import block_of
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import (
    Address1,
    Array2,
    Index1,
    Index2,
    Scratch1,
    Scratch2,
    Table,
    table,
)
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.foreign import Entry
from rom.mbs.parts.joints import Whole
from rom.model import Array, Index
from rom.names import offered

# of a law, as numba.cfunc takes it
LAW_SIGNATURE = "void(CPointer(f8), CPointer(f8), i8, CPointer(f8), CPointer(f8))"
LAW_MEMORY_SIZE = 256  # numbers that a law may use as memory
QUATERNION_ATOL = 1e-9  # difference of a quaternion from unit length


@dataclass(frozen=True)
class Frames:
    """Frames of a body with the inertia lumped at them; axes of the body.

    Attributes:
        x: (n, 3) origins [m].
        p: (n, 4) unit quaternions, frame to body [1].
        mass: (n,) [kg].
        inertia: (n, 3) principal moments about the origin, axes of the frame [kg m^2].
    """

    x: Array
    p: Array
    mass: Array
    inertia: Array


@dataclass(frozen=True)
class Elements:
    """Elements with one law.

    Attributes:
        address: of the law in memory.
        frames: (e, k) frames that each element connects.
        numbers: (e, c) what the law knows of each element, in its own units.
        law: kept so that the compiled code lives as long as the elements.
        by_rate: whether forces depend on velocities.
    """

    address: int
    frames: Index
    numbers: Array
    law: Entry | None = None
    by_rate: bool = True

    @classmethod
    def of(cls, law: Entry, frames: Index, numbers: Array, *, by_rate: bool = True) -> "Elements":
        """Elements with a law of `compiled_law`."""
        return cls(law.address, frames, numbers, law, by_rate)


class NonlinearBody(Protocol):
    """A flexible body of any kinematics."""

    @property
    def frames(self) -> Frames:
        """Where the body is at the start, and its inertia."""

    @property
    def elements(self) -> Sequence[Elements]:
        """What acts between the frames."""

    @property
    def places(self) -> Mapping[str, int]:
        """Frames at which markers have names."""

    @property
    def coincident(self) -> Sequence[tuple[int, int]]:
        """Pairs of frames with one origin, which turn each for itself."""


@typed
@dataclass(frozen=True)
class Assembly:
    """A non-linear body in a mechanism: frame k is the body ``name.k``."""

    name: str
    body: NonlinearBody  # what was added
    parts: tuple[Part, ...]  # the bodies of its frames

    def marker(self, place: str | int) -> Marker:
        """Handle of a named place, or of the origin of a frame, counted from 0 or the end."""
        frame = self.body.places.get(place) if isinstance(place, str) else place
        if isinstance(frame, bool) or not isinstance(frame, int | np.integer):
            there = f"{offered(self.body.places, place)} and frames 0 to {len(self.parts) - 1}"
            raise ConfigError(f"body {self.name!r} has no marker {place!r}; it has {there}.")
        n = len(self.parts)
        whole(f"frame of body {self.name!r}", frame, -n, n - 1)
        return self.parts[frame].marker((0.0, 0.0, 0.0))

    @property
    def reach(self) -> float:
        """Length of the line through all frames [m]."""
        return float(sum(np.linalg.norm(b.at - a.at) for a, b in pairwise(self.parts)))


def compiled_law(function: Callable[..., None]) -> Entry:
    """The law that a Python function describes, compiled and kept; it makes arrays of pointers."""
    return compiled_entry(function, LAW_SIGNATURE)


def add_nonlinear(
    self: Whole,
    name: str,
    body: NonlinearBody,
    *,
    at: Point = (0.0, 0.0, 0.0),
    orientation: Orientation | None = None,
    velocity: Velocity | None = None,
    omega: Omega | None = None,
) -> Assembly:
    """Add a non-linear flexible body, e.g. a rod; see `rom.components.cosserat.body`.

    Args:
        name: name of the body; its frames become bodies ``name.0``, ``name.1``, ...
        body: see `NonlinearBody`.
        at: (3,) origin of the body at the start, world [m].
        orientation: (3, 3) matrix or (4,) quaternion [1], body to world; None for parallel.
        velocity: (3,) of that origin, world [m/s].
        omega: (3,) angular velocity of the body as a whole, axes of the body [rad/s].

    Raises:
        ModelError: naming a frame without mass or inertia.
    """
    self.check_new(name)
    _check(name, body)
    pose = start_pose(at, orientation, velocity, omega)
    n = len(body.frames.x)
    parts = tuple(_frame_part(f"{name}.{k}", body.frames, k, pose) for k in range(n))
    assembly = Assembly(name, body, parts)
    for part in parts:
        self.check_new(part.name)
    self.parts.update({part.name: part for part in parts})
    self.add(name, assembly, NONLINEAR_FAMILY)
    for a, b in body.coincident:
        self.spherical(f"{name}.{a} and {b}", assembly.marker(a), assembly.marker(b))
    return assembly


def _frame_part(name: str, frames: Frames, k: int, pose: tuple[Array, ...]) -> Part:
    """The body of frame k, moved with the pose of the whole."""
    at, p, velocity, omega = pose
    A, J = rotation.matrix(p), frames.inertia[k]
    arm = A @ frames.x[k]
    turned = rotation.matrix(frames.p[k]).T @ omega
    second = 0.5 * J.sum() * np.eye(3) - np.diag(J)
    moving = velocity + np.cross(A @ omega, arm), turned
    p = rotation.multiply(p, frames.p[k])
    return Part(name, float(frames.mass[k]), np.zeros(3), second, at + arm, p, *moving)


def _check(name: str, body: NonlinearBody) -> None:
    missing = [x for x in ("frames", "elements", "places", "coincident") if not hasattr(body, x)]
    if missing:
        hint = "Make one with rom.components.cosserat.body; reduced ones go to add_flexible."
        raise ConfigError(f"body {name!r} is {body!r}, without {', '.join(missing)}.", hint=hint)
    frames, n = body.frames, len(body.frames.x)
    for key, shape in (("x", (n, 3)), ("p", (n, 4)), ("mass", (n,)), ("inertia", (n, 3))):
        finite(f"{key} of {name}", getattr(frames, key), shape)
    if fault := next(_faults(frames, body.elements), ""):
        raise ModelError(fault, where=name)


def _faults(frames: Frames, elements: Sequence[Elements]) -> Iterator[str]:
    n, without = len(frames.x), (frames.mass <= 0.0) | (frames.inertia <= 0.0).any(axis=1)
    if without.any():
        k = int(np.argmax(without))
        both = f"mass {frames.mass[k]:g} kg and inertia {frames.inertia[k].tolist()} kg m^2"
        yield f"frame {k} of {n} has {both}: each must be positive in a motion."
    if np.abs(np.linalg.norm(frames.p, axis=1) - 1.0).max() > QUATERNION_ATOL:
        yield "each quaternion of a frame must have the length one."
    for group in elements:
        if group.frames.ndim != 2 or len(group.frames) != len(group.numbers):
            yield "frames (e, k) and numbers must be of the same e elements."
        if group.frames.min(initial=0) < 0 or group.frames.max(initial=0) >= n:
            yield f"elements must connect frames from 0 to {n - 1}."
        if not group.address:
            yield "elements need a compiled law; give its address."


@table
class Nonlinear(Table):
    """Elements of non-linear bodies between up to K frames, each with a compiled law."""

    address: Address1  # (e,) of the laws
    count: Index1  # (e,) number of frames
    body: Index2  # (e, K) their bodies, -1 beyond
    numbers: Array2  # (e, c) what the law knows of the element
    pose: Scratch2  # (e, 13 K) frames at the last residual: position, quaternion, velocities
    answer: Scratch1  # (2 + 6 K + 72 K^2,) what a law says
    space: Scratch1  # (LAW_MEMORY_SIZE,) for the laws to use as they like
    owner: Index1  # (e,) which of the bodies an element is part of
    forces: Scratch1  # (n,) sum of all force components of each body: not finite where a law failed
    by_rate: Index1  # (e,) 1 where forces depend on velocities


def pack(bodies: Mapping[str, Assembly], places: Places) -> Nonlinear:
    """The elements of all bodies as arrays."""
    groups = [
        (k, group, np.array([places.body[part.name] for part in whole.parts])[group.frames])
        for k, whole in enumerate(bodies.values())
        for group in whole.body.elements
    ]
    e = sum(len(rows) for *_, rows in groups)
    K = max((rows.shape[1] for *_, rows in groups), default=1)
    c = max((group.numbers.shape[1] for _, group, _ in groups), default=1)
    body, numbers = np.full((e, K), -1, dtype=np.int64), np.zeros((e, c))
    address, count, owner, by_rate, at = *(integers([0] * e) for _ in range(4)), 0
    for k, group, rows in groups:
        mine = slice(at, at + len(rows))
        address[mine], count[mine], owner[mine] = group.address, rows.shape[1], k
        by_rate[mine] = group.by_rate
        body[mine, : rows.shape[1]] = rows
        numbers[mine, : group.numbers.shape[1]] = group.numbers
        at += len(rows)
    scratch = np.zeros((e, 13 * K)), np.zeros(2 + 6 * K + 72 * K * K), np.zeros(LAW_MEMORY_SIZE)
    forces = np.zeros(len(bodies))
    return Nonlinear(address, count, body, numbers, *scratch, owner, forces, by_rate)


@intrinsic
def ask(_context, address, numbers, pose, wanted, answer, space):
    """Call the law at an address with arrays; its signature is told above."""
    return called(types.void(address, numbers, pose, wanted, answer, space))


@inner
def take_frames(s, elements, e, q, v):
    """Copy the frames of element e to its row of poses."""
    bodies = s.bodies
    for k in range(elements.count[e]):
        at, vt = bodies.q_at[elements.body[e, k]], bodies.v_at[elements.body[e, k]]
        for i in range(7):
            elements.pose[e, 13 * k + i] = q[at + i]
        for i in range(6):
            elements.pose[e, 13 * k + 7 + i] = v[vt + i]


@inner
def ask_element(elements, e, wanted):
    """Let the law of element e answer for its frames, with tangents if they are wanted."""
    N = elements
    ask(N.address[e], N.numbers[e], N.pose[e], wanted, N.answer, N.space)


@residuals.of(Nonlinear)
def nonlinear_residuals(s, W, elements, q, v, _lam):
    """Add the forces of all elements to W.residual, and the power they lose to W.power[2]."""
    elements.forces[:] = 0.0
    for e in range(elements.address.size):
        take_frames(s, elements, e, q, v)
        ask_element(elements, e, 0)
        W.power[2] += elements.answer[1]
        for k in range(elements.count[e]):
            t = s.bodies.v_at[elements.body[e, k]]
            for i in range(6):
                W.residual[t + i] += elements.answer[2 + 6 * k + i]
                elements.forces[elements.owner[e]] += elements.answer[2 + 6 * k + i]


@tangents.of(Nonlinear)
def nonlinear_tangents(s, W, elements, _lam, ck, cc):
    """Add stiffness times ck and damping times cc to W.Kt and W.S; `nonlinear_residuals` first."""
    graph = s.graph
    for e in range(elements.address.size):
        ask_element(elements, e, 1)
        n = 6 * elements.count[e]
        for k in range(elements.count[e]):
            for l in range(elements.count[e]):
                block = block_of(graph, elements.body[e, k], elements.body[e, l])
                x, y = graph.x[block], graph.y[block]
                for i in range(6):
                    at = 2 + n + (6 * k + i) * n + 6 * l
                    for j in range(6):
                        W.Kt[x + i, y + j] += ck * elements.answer[at + j]
                        W.S[x + i, y + j] += cc * elements.answer[at + n * n + j]


@energy.of(Nonlinear)
def nonlinear_energy(s, _W, elements, q, v):
    """Energy stored in all elements."""
    total = 0.0
    for e in range(elements.address.size):
        take_frames(s, elements, e, q, v)
        ask_element(elements, e, 0)
        total += elements.answer[0]
    return total


NONLINEAR_FAMILY = Family(
    "nonlinear",
    Assembly,
    pack,
    *(nonlinear_residuals, nonlinear_tangents, nonlinear_energy),
    ends=on_joint,
    # elements of one frame alone push it from outside, as wind does
    outside=lambda whole: any(group.frames.shape[1] == 1 for group in whole.body.elements),
    couples=lambda elements, _: [
        bodies[:n] for n, bodies in zip(elements.count, elements.body, strict=True)
    ],
    by_rate=lambda elements: bool(elements.by_rate.any()),
    hooks=Hooks(answers=lambda elements: elements.forces),
)
