"""Where bodies and markers are in the instants that are drawn."""

from dataclasses import dataclass

import numpy as np

import rom.mbs
from rom.arguments import AnyMechanism
from rom.mbs.parts.bodies import GROUND, Marker
from rom.model import Array, Index
from rom.rotation import matrix

Steps = Index | list[int]  # numbers of instants
Pose = tuple[Array, Array]  # (f, 3) origins and (f, 3, 3) axes, as columns in the world
MAX_CANDIDATES = 400  # instants that are compared
SAME_PLACE_RATIO = 0.02  # of the longest way, below which two places are one
NO_TURN, NO_SHIFT = np.eye(3), np.zeros(3)


@dataclass(frozen=True, slots=True)
class Places:
    """Bodies of a mechanism in f instants."""

    mechanism: AnyMechanism
    poses: dict[str, Pose]  # of the frame of each body
    elastic: dict[str, Array]  # (f, r) elastic coordinates of each body
    magnify: float = 1.0  # deformations are drawn so many times larger than they are

    def pose(self, body: str) -> Pose:
        """Of the frame of a body, or the ground."""
        return (np.zeros((1, 3)), np.eye(3)[None]) if body == GROUND else self.poses[body]

    def point(self, marker: Marker) -> Array:
        """(f, 3) where a marker is drawn; (1, 3) on the ground [m]."""
        part = self.mechanism.part(marker.body)
        X = part.point(marker)[None]
        if part.flexible is not None:
            X = X + self.magnify * self.elastic[marker.body] @ part.shapes(marker)[0].T
        r, A = self.pose(marker.body)
        return r + np.einsum("fab,fb->fa", A, np.broadcast_to(X, r.shape))

    def frame(self, marker: Marker, axes: Array = NO_TURN, shift: Array = NO_SHIFT) -> Pose:
        """Axes (3, 3), as columns, at a marker, both turning with its body; shifted in its axes."""
        r, A = self.point(marker), self.pose(marker.body)[1]
        return at(r + A @ shift, A @ axes)

    def direction(self, body: str, vector: Array) -> Array:
        """(f, 3) direction in the world of one that is fixed in a body."""
        return self.pose(body)[1] @ vector


def at_start(mechanism: "rom.mbs.Mechanism") -> Places:
    """Bodies where they were added."""
    parts = mechanism.parts.items()
    poses = {name: (part.at[None], matrix(part.p)[None]) for name, part in parts}
    return Places(mechanism, poses, {name: part.q[None] for name, part in parts})


def moving(
    mechanism: "rom.mbs.Mechanism", solution: "rom.mbs.Solution", steps: Steps, magnify: float
) -> Places:
    """Bodies at some of the instants of a motion."""
    poses, elastic = {}, {}
    for name in mechanism.parts:
        axes = np.array([matrix(p) for p in solution.orientation(name)[steps]])
        poses[name] = solution.position(name)[steps], axes
        elastic[name] = solution.elastic(name)[steps]
    return Places(mechanism, poses, elastic, magnify)


def evenly(size: int, n: int) -> Index:
    """(n,) numbers of so many instants, evenly over all of a motion."""
    return np.linspace(0, size - 1, n).round().astype(int)


def at(r: Array, A: Array) -> Pose:
    """A pose from (f or 1, 3) points and (f or 1, 3, 3) axes."""
    n = max(len(r), len(A))
    return np.broadcast_to(r, (n, 3)), np.broadcast_to(A, (n, 3, 3))


def placed(X: Array, pose: Pose) -> Array:
    """(f, n, 3) world positions of body points (1 or f, n, 3)."""
    r, A = pose
    return r[:, None] + np.einsum("fab,fnb->fna", A, np.broadcast_to(X, (len(r), *X.shape[1:])))


def different(solution: "rom.mbs.Solution", n: int) -> Array:
    """(n,) instants [s] that differ most, the start and each the farthest from those before."""
    steps = np.unique(evenly(solution.t.size, MAX_CANDIDATES))
    places, parts = moving(solution.mechanism, solution, steps, 1.0), solution.mechanism.parts
    points = [r for r, _ in places.poses.values()]
    points += [places.point(part.marker(name)) for part in parts.values() for name in part.names]
    X = np.concatenate(points, axis=1) if points else np.zeros((steps.size, 3))
    chosen, away = [0], np.linalg.norm(X - X[0], axis=1)
    least = SAME_PLACE_RATIO * away.max()
    while len(chosen) < n and away.max() > least:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(X - X[chosen[-1]], axis=1))
    return np.sort(solution.t[steps[chosen]])
