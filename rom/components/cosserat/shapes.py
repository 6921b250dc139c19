"""Rods from stations, and the shapes they take.

Source:
    See docs/theory/rods.md.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.components.cosserat.energy import Rod, strains, work
from rom.errors import ModelError
from rom.model import Array, Mask

Curve = Callable[[float], tuple[npt.ArrayLike, npt.ArrayLike]]
FLAT_COSINE = np.cos(np.pi / 4 * 0.99)  # neighbours turned further have no side to bend to


@dataclass(frozen=True)
class Shape:
    """Where a rod is.

    Attributes:
        x: (N + 1, 3) positions of the vertices [m].
        p: (N + 2, 4) quaternions [1] of plate, segments, plate; section axes to world, third along.
    """

    x: Array
    p: Array

    def frame(self, k: int) -> Array:
        """(3, 3) section axes as columns [1]: plate 0, segments 1 to N, plate N + 1 or -1."""
        return rotation.matrix(self.p[k])


def rod(  # noqa: PLR0913  one keyword per property of the rod
    x: npt.ArrayLike,
    p: npt.ArrayLike,
    *,
    stretch: npt.ArrayLike,
    bend: npt.ArrayLike,
    mass: npt.ArrayLike = 0.0,
    inertia: npt.ArrayLike = 0.0,
    viscosity: npt.ArrayLike = 0.0,
    bends: npt.ArrayLike = True,
) -> Rod:
    """A rod whose reference is the shape it has without stress.

    Args:
        x: (N + 1, 3) vertices [m].
        p: (N + 2, 4) unit quaternions [1] of the plate at the start, the N segments and the plate
            at the end: section axes to world, the third along the rod. The rotation between a plate
            and the segment beside it is that over half a segment.
        stretch: (N, 3) or (3,) rigidities GA1, GA2, EA of the segments [N].
        bend: (N + 1, 3) or (3,) rigidities EI1, EI2, GJ at the vertices [N m^2].
        mass: (N,) or scalar, per length [kg/m]; lumped, half of each segment at either vertex.
        inertia: (N, 3) or (3,), per length about the section axes [kg m].
        viscosity: (6,) or scalar, ratio of viscous to elastic rigidities, stretch before bend [s].
        bends: (N,) whether a segment shares in the bending [1]; one that does not is a rigid link
            as far as its stretch rigidity is high.

    Raises:
        ModelError: naming the segment or vertex with coincident stations, a rigidity that is not
            positive or neighbours that face each other.
    """
    x, p = np.array(x, dtype=float), np.array(p, dtype=float)
    n = len(x) - 1
    if n < 1 or x.shape != (n + 1, 3) or p.shape != (n + 2, 4):
        text = f"a rod of {len(x)} vertices with quaternions of shape {p.shape}."
        raise ModelError(text, hint="N segments have N + 1 vertices and N + 2 quaternions.")
    h = np.linalg.norm(np.diff(x, axis=0), axis=1)
    _refuse(h <= 0.0, "segment", "has coincident stations", "Remove one of them.")
    rigid = ~np.broadcast_to(np.asarray(bends, dtype=bool), n)
    own = np.where(rigid, 0.0, h) / 2
    l = np.append(own, 0.0) + np.append(0.0, own)
    stiff = l == 0.0
    l[stiff] = ((np.append(h, 0.0) + np.append(0.0, h)) / 2)[stiff]
    C, B = np.empty((n, 3)), np.empty((n + 1, 3))
    C[:], B[:] = stretch, bend
    _refuse((C <= 0).any(axis=1), "segment", "has a stretch rigidity that is not positive", "")
    _refuse((B <= 0).any(axis=1), "vertex", "has a bending rigidity that is not positive", "")
    turns: Array = p / np.linalg.norm(p, axis=1)[:, None]
    s = np.array([_root(a, b) for a, b in pairwise(turns)])
    _refuse(s[:, 0] < FLAT_COSINE, "vertex", "turns back on itself", "Place stations more densely.")
    ways = zip(turns[1:-1], np.diff(x, axis=0), strict=True)
    a0 = np.array([rotation.matrix(q).T @ d for q, d in ways]) / h[:, None]
    lumped = np.zeros(n + 1)
    lumped[:-1] += h / 2 * mass
    lumped[1:] += h / 2 * mass
    J = np.zeros((n + 2, 3))
    J[1:-1] = h[:, None] * np.asarray(inertia, dtype=float)
    viscosity = np.broadcast_to(np.asarray(viscosity, dtype=float), 6)
    S = np.array([rotation.matrix(r) for r in s])
    return Rod(h, C, a0, l, B, s, S, lumped, J, C * viscosity[:3], B * viscosity[3:], x, turns)


def _root(a: Array, b: Array) -> Array:
    """Square root of the rotation from a to b, in the frame of a."""
    r = rotation.multiply(a * [1, -1, -1, -1], b)
    r = r if r[0] >= 0 else -r
    r[0] += 1
    return r / np.linalg.norm(r)


def _refuse(bad: Mask, what: str, why: str, hint: str) -> None:
    if np.any(bad):
        raise ModelError(f"{what} {int(np.argmax(bad))} of the rod {why}.", hint=hint)


def straight(
    length: float,
    n: int,
    *,
    start: npt.ArrayLike = (0, 0, 0),
    frame: npt.ArrayLike | None = None,
    **section: npt.ArrayLike,
) -> Rod:
    """A straight rod of n equal segments.

    Args:
        length: of the rod [m].
        n: number of segments.
        start: (3,) first vertex [m].
        frame: (3, 3) section axes as columns [1], the third along the rod; None for the world's.
        section: rigidities, mass and more as for `rod`.

    Raises:
        ModelError: as `rod`.
    """
    A = np.eye(3) if frame is None else np.asarray(frame, dtype=float)
    x = np.asarray(start, dtype=float) + np.outer(np.linspace(0, length, n + 1), A[:, 2])
    return rod(x, np.tile(rotation.quaternion(A), (n + 2, 1)), **section)


def along(place: Curve, stations: npt.ArrayLike, **section: npt.ArrayLike) -> Rod:
    """A rod along a curve.

    The place is position (3,) [m] and section axes (3, 3), columns, third tangent, at a station;
    stations (N + 1,) of the vertices are in units of the parameter of the curve. Rigidities, mass
    and more are as for `rod`.

    Raises:
        ModelError: as `rod`.
    """
    s = np.asarray(stations, dtype=float)
    middles = np.concatenate(([s[0]], (s[1:] + s[:-1]) / 2, [s[-1]]))
    frames = [rotation.quaternion(place(at)[1]) for at in middles]
    x = np.array([place(at)[0] for at in s], dtype=float)
    return rod(x, np.array(frames), **section)


def reference(rod: Rod) -> Shape:
    """The shape without stress."""
    return Shape(rod.x.copy(), rod.p.copy())


def elastic_energy(rod: Rod, shape: Shape) -> float:
    """Energy of a shape [J]."""
    a, k = strain(rod, shape)
    stretched, bent = (rod.stretch * a**2).sum(axis=1), (rod.bend * k**2).sum(axis=1)
    return float(0.5 * (rod.h @ stretched + rod.l @ bent))


def strain(rod: Rod, shape: Shape) -> tuple[Array, Array]:
    """(N, 3) shear and stretch of the segments, and (N + 1, 3) curvature of the vertices [1/m]."""
    a, k = np.empty_like(rod.a0), np.empty_like(rod.bend)
    strains(rod, shape.x, shape.p, work(rod), a, k)
    return a, k
