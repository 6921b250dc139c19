"""Tendons: cables over ordered holes in plates that move, with friction where they turn.

A piece between two holes of different plates is straight and its length is
l = |x_b + R_b e_b - x_a - R_a e_a|; inside one plate, or one rigid link, it does not change.

Source:
    Euler's and Eytelwein's formula of rope friction, T = T_0 exp(-mu psi), hole by hole.
"""

from dataclasses import dataclass

import numpy as np

from rom import rotation
from rom.arguments import not_negative, typed
from rom.components.cosserat import Rod, Shape
from rom.errors import ModelError
from rom.model import Array


@dataclass(frozen=True)
class Hole:
    """A place where a cable passes a plate.

    Attributes:
        vertex: of the rod that carries the plate.
        frame: quaternion that turns with the plate: 0 start, 1 to N segments, N + 1 end.
        arm: (3,) from the vertex, in axes of the plate [m].
    """

    vertex: int
    frame: int
    arm: tuple[float, float, float]


@typed
@dataclass(frozen=True)
class Tendon:
    """A cable through holes, pulled at the first and fixed at the last.

    Attributes:
        holes: in the order in which the cable passes them.
        friction: coefficient where the cable turns at a hole [1].
        conduit: angle by which a conduit between actuator and first hole turns [rad].

    Raises:
        ModelError: for fewer than two holes, or numbers below zero.
    """

    holes: tuple[Hole, ...]
    friction: float = 0.0
    conduit: float = 0.0

    def __post_init__(self) -> None:
        if len(self.holes) < 2:
            raise ModelError(f"a tendon of {len(self.holes)} holes.", hint="It needs two ends.")
        not_negative("friction of a tendon", self.friction, error=ModelError)
        not_negative("conduit of a tendon", self.conduit, error=ModelError)

    def points(self, shape: Shape) -> Array:
        """(k, 3) holes in the world [m]."""
        return np.array([shape.x[h.vertex] + shape.frame(h.frame) @ h.arm for h in self.holes])

    def length(self, shape: Shape) -> float:
        """From the first hole to the last [m]."""
        return float(np.linalg.norm(np.diff(self.points(shape), axis=0), axis=1).sum())

    def turns(self, shape: Shape) -> Array:
        """(k,) angle by which the cable turns at each hole, none at its ends [rad]."""
        d = np.diff(self.points(shape), axis=0)
        d = d / np.linalg.norm(d, axis=1)[:, None]
        sine = np.linalg.norm(np.cross(d[:-1], d[1:]), axis=1)
        return np.concatenate(([0.0], np.arctan2(sine, (d[:-1] * d[1:]).sum(axis=1)), [0.0]))

    def tensions(self, shape: Shape, way: float = 1.0) -> Array:
        """(k - 1,) tension of the pieces over that at the first hole [1].

        The way is 1 when the cable is pulled in, -1 when it is let out, 0 without friction [1].
        """
        return np.exp(-way * self.friction * np.cumsum(self.turns(shape)[:-1]))

    def actuator(self, tension: float, way: float = 1.0) -> float:
        """Force behind the conduit by that at the first hole [N]; the way is as of `tensions`."""
        return tension * float(np.exp(way * self.friction * self.conduit))

    def forces(self, rod: Rod, shape: Shape, way: float = 1.0) -> tuple[Array, Array]:
        """What a tension of 1 N at the first hole adds to forces out of balance and tangent.

        Gradient (n,) [1, m] and tangent (n, n) [1/m, 1, m] per newton are in the order of
        `cosserat.linearised`; the tangent leaves out that friction changes with the shape. The way
        is as of `tensions`.
        """
        n = 6 * rod.h.size + 9
        r, K = np.zeros(n), np.zeros((n, n))
        pieces = zip(self.holes[:-1], self.holes[1:], self.tensions(shape, way), strict=True)
        for a, b, tension in pieces:
            if a.frame != b.frame:
                first = [6 * a.vertex + 3, 6 * a.frame, 6 * b.vertex + 3, 6 * b.frame]
                rows = np.add.outer(first, np.arange(3)).ravel()
                g, H = _piece(shape, a, b)
                r[rows] += tension * g
                K[np.ix_(rows, rows)] += tension * H
        return r, K


def _piece(shape: Shape, a: Hole, b: Hole) -> tuple[Array, Array]:
    """Gradient and exact tangent of the length of a piece for x_a, phi_a, x_b, phi_b."""
    A, B = shape.frame(a.frame), shape.frame(b.frame)
    d = shape.x[b.vertex] + B @ b.arm - shape.x[a.vertex] - A @ a.arm
    l = np.linalg.norm(d)
    c = d / l
    D = np.hstack([-np.eye(3), A @ rotation.skew(a.arm), np.eye(3), -B @ rotation.skew(b.arm)])
    g = D.T @ c
    H = D.T @ (np.eye(3) - np.outer(c, c)) @ D / l
    for at, R, arm, sign in ((3, A, a.arm, -1.0), (9, B, b.arm, 1.0)):
        w, e = sign * R.T @ c, np.asarray(arm)  # w . (R e) has second derivatives by turns of R
        turned = 0.5 * (np.outer(w, e) + np.outer(e, w)) - (w @ e) * np.eye(3)
        H[at : at + 3, at : at + 3] += turned + 0.5 * rotation.skew(g[at : at + 3])
    return g, H
