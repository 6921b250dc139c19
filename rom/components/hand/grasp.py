"""A finger that closes on a round bar: penalty contact along its centre line."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.components.cosserat import Shape
from rom.components.hand.compliant_hand import Finger, Posture, close, rest
from rom.errors import ConfigError
from rom.model import Array

ON_A_LINK = np.linspace(0, 1, 7)[1:-1]  # places on a phalanx that are watched, beside its ends


@dataclass(frozen=True)
class Bar:
    """A fixed cylinder across the finger, its axis along the second axis.

    Attributes:
        centre: (2,) in the plane of the finger, towards the palm and along [m].
        radius: of the bar [m].
        thickness: half that of the finger [m].
        stiffness: of the skin, per watched place [N/m].
    """

    centre: tuple[float, float]
    radius: float
    thickness: float = 5e-3
    stiffness: float = 3e3

    def places(self, finger: Finger) -> tuple[Array, Array, Array]:
        """Watched places of the finger.

        Returns:
            (k,) vertex, (k,) share of the way to the next one [1], and (k, 2) shares of both [1].
        """
        n = finger.rod.h.size
        links = [top for (_, _, top, _) in finger.joints if top < n]
        vertex = np.concatenate(
            [np.arange(n), *(np.full(ON_A_LINK.size, i) for i in links), [n - 1]]
        )
        share = np.concatenate([np.zeros(n), np.tile(ON_A_LINK, len(links)), [1.0]])
        return vertex, share, np.column_stack([1 - share, share])

    def gaps(self, finger: Finger, shape: Shape) -> tuple[Array, Array]:
        """Gap (k,) at the watched places [m], negative in contact, and (k, 2) direction outward."""
        vertex, share, _ = self.places(finger)
        points = shape.x[vertex] + share[:, None] * (shape.x[vertex + 1] - shape.x[vertex])
        d = points[:, [0, 2]] - self.centre
        distance = np.linalg.norm(d, axis=1)
        return distance - self.radius - self.thickness, d / distance[:, None]

    def contact(self, finger: Finger) -> Callable[[Shape], tuple[Array, Array]]:
        """Forces out of balance and tangent of the contact, for `compliant_hand.close`."""
        vertex, _, halves = self.places(finger)
        n = 6 * finger.rod.h.size + 9

        def forces(shape: Shape) -> tuple[Array, Array]:
            r, K = np.zeros(n), np.zeros((n, n))
            gaps, normals = self.gaps(finger, shape)
            for k in np.flatnonzero(gaps < 0):
                e, gap = normals[k], gaps[k]
                rows = 6 * vertex[k] + np.array([3, 5, 9, 11])
                D = np.hstack([halves[k, 0] * np.eye(2), halves[k, 1] * np.eye(2)])
                distance = gap + self.radius + self.thickness
                H = np.outer(e, e) + gap / distance * (np.eye(2) - np.outer(e, e))
                r[rows] += self.stiffness * gap * D.T @ e
                K[np.ix_(rows, rows)] += self.stiffness * D.T @ H @ D
            return r, K

        return forces

    def pressure(self, posture: Posture) -> tuple[Array, Array]:
        """Force (k,) of the bar on the watched places [N], and its direction (k, 2)."""
        gaps, normals = self.gaps(posture.finger, posture.shape)
        return self.stiffness * np.maximum(-gaps, 0.0), normals


def grasp(finger: Finger, bar: Bar, tensions: npt.ArrayLike) -> list[Posture]:
    """Postures while the cable is tightened around a bar.

    Args:
        finger: the finger, straight at the start.
        bar: what it closes on.
        tensions: (n,) growing tensions of the cable [N].

    Raises:
        ConfigError: if the bar is in the way of the straight finger.
        SolverError: if no posture was found; ``error.solution`` is the last good one.

    Source:
        Contact by a penalty: Wriggers, Computational Contact Mechanics (2006).
    """
    posture = rest(finger)
    gap = bar.gaps(finger, posture.shape)[0].min()
    if gap < 0:
        raise ConfigError(f"the bar reaches {-gap:g} m into the straight finger.",
                          hint="Move its centre away.")  # fmt: skip
    contact, found = bar.contact(finger), []
    for tension in np.asarray(tensions, dtype=float):
        posture = close(finger, tension=float(tension), start=posture, extra=contact)
        found.append(posture)
    return found
