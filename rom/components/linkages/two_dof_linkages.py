"""Generalised inertia of planar linkages with two motors, their links rigid or reduced bodies.

Every link moves in its own frame with a constant mass matrix; the inertia the motors feel is the
sum of J^T M J over the links, with the velocities J of a link per unit of all rates. Elastic
coordinates are held, vibrate with the torques of the motors, or are free. `mechanism_inertia` finds
the same from the mass matrix and the constraints of any `rom.Mechanism`.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from scipy.linalg import null_space

from rom.arguments import NotNegative, one_of, typed
from rom.arguments.quantities import Quantity, Size
from rom.body.flexible import FlexibleBody
from rom.components.linkages.chains import (
    ClosedLinkage,
    Inertia,
    Link,
    Linkage,
    Mass,
    Motion,
    MovedMass,
    both,
    directions,
)
from rom.errors import ConfigError, ModelError
from rom.mbs.equations.equations import linearize_constraints
from rom.mbs.equations.packing import pack
from rom.mbs.integrate.consistent_start import assembled
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Mechanism
from rom.model import Array, Index
from rom.names import check_known

KEPT_POSTURES = 4096  # whose inertia is known: asking whether it exists costs nothing more
# of a drive between two assemblies [rad, or sizes of the mechanism]: farther, it closes elsewhere
MAX_FOLLOWED = 0.5
Centre = Annotated[npt.ArrayLike, Quantity("m", ((2,),), error=ModelError)]


@typed
def rigid_link(mass: MovedMass, length: Size, centre: Centre, inertia: Inertia) -> Link:
    """A rigid link.

    Args:
        mass: [kg].
        length: distance of the pins [m].
        centre: (2,) mass centre from the first pin, along and across [m].
        inertia: about the mass centre [kg m^2].
    """
    x, y = np.asarray(centre, dtype=float)
    J = inertia + mass * (x * x + y * y)
    M = np.array([[mass, 0, -mass * y], [0, mass, mass * x], [-mass * y, mass * x, J]])
    return Link(length, M, np.zeros((2, 0)), np.zeros((0, 0)))


@typed
def rod(mass: MovedMass, length: Size) -> Link:
    """A uniform slender rod of that mass [kg] and length [m]."""
    return rigid_link(mass, length, (length / 2, 0.0), mass * length**2 / 12)


@typed
def reduced_link(body: FlexibleBody, first: str, second: str) -> Link:
    """A reduced flexible body as a link in the plane of its x and y axes.

    Its frame is moved to the first pin and turns with it. The body should be symmetric about the
    plane: motion out of it is not prevented.

    Args:
        body: the body, pins along z.
        first: name of the interface at the first pin, towards the motor.
        second: name of the interface at the second pin.

    Raises:
        InterfaceError: if an interface is unknown.
        ModelError: if the pins coincide in the plane.
    """
    body = body.with_reference(first)
    a, b = body.marker(first).point, body.marker(second)
    axis = (b.point - a)[:2]
    length = float(np.hypot(*axis))
    if length == 0.0:
        raise ModelError(f"pins {first!r} and {second!r} lie on one axis along z; take others.")
    e = axis / length
    R = np.array([[e[0], e[1]], [-e[1], e[0]]])  # world axes to along and across
    x, y = R @ (body.first_moment - body.mass * a)[:2]
    d = body.first_moment
    J = body.inertia[2, 2] - 2 * (a[:2] @ d[:2]) + body.mass * (a[:2] @ a[:2])
    spin = body.Ibar_kl[0, 1] - body.Ibar_kl[1, 0] - (a[0] * body.S[1] - a[1] * body.S[0])
    rigid = np.array([[body.mass, 0, -y], [0, body.mass, x], [-y, x, J]])
    coupling = np.vstack([R @ body.S[:2], spin])
    M = np.block([[rigid, coupling], [coupling.T, body.M]])
    return Link(length, M, R @ b.translation[:2], body.K)


@typed
@dataclass(frozen=True, slots=True)
class TwoLink(Linkage):
    """A chain of two links on a fixed pivot, a point mass at its end.

    Attributes:
        first, second: the links.
        payload: mass at the tip [kg].
        relative: the second coordinate is the angle of the second link against the first one
            (motor on the elbow) and not against the ground.
    """

    first: Link
    second: Link
    payload: Mass = 0.0
    relative: bool = False

    @property
    def _links(self) -> tuple[Link, ...]:
        return self.first, self.second

    def tip(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2) where the end of the chain is at angles (...) [m]; q1 and q2 in [rad]."""
        q1, q2 = both(q1, q2)
        angle = q2 + self.relative * q1
        return self.first.length * directions(q1) + self.second.length * directions(angle)

    def _moved(self, links: tuple[Link, ...], q: tuple[Array, Array], at: Index) -> Motion:
        (q1, q2), rates = q, np.eye(int(at[-1]))[:, None]
        motion = Motion.at_rest(q1.size, int(at[-1]))
        motion.add(links[0], q1, rates[0], at[0])
        motion.add(links[1], q2 + self.relative * q1, rates[1] + self.relative * rates[0], at[1])
        return motion


@typed
@dataclass(frozen=True, slots=True)
class FiveBar(ClosedLinkage):
    """Two driven cranks on a common base, two couplers that meet in the tip.

    Coordinates are the angles of the left and of the right crank against the base [rad].

    Attributes:
        base: distance of the driven pivots, along x [m].
        cranks, couplers: the links of the left and the right side, first pins towards the motors.
        payload: point mass at the tip [kg].
        side: 1 for the tip to the left of the line from the left to the right elbow, -1 for right.

    Raises:
        ModelError: for an unknown side.
    """

    base: Annotated[float, NotNegative("m", error=ModelError)]
    cranks: tuple[Link, Link]
    couplers: tuple[Link, Link]
    payload: Mass = 0.0
    side: int = 1

    @property
    def _links(self) -> tuple[Link, ...]:
        return self.cranks + self.couplers

    def posture(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 5, 2) left pivot, left elbow, tip, right elbow, right pivot [m].

        Coordinates (...,) are angles of the left and the right crank against the base [rad].

        Raises:
            ModelError: if the couplers cannot reach each other at some angles.
        """
        tip, (left, right) = self.tip(q1, q2), self._elbows(*both(q1, q2))
        pivots = np.zeros((2, *tip.shape))
        pivots[1, ..., 0] = self.base
        return np.stack([pivots[0], left, tip, right, pivots[1]], axis=-2)

    def _elbows(self, q1: Array, q2: Array) -> tuple[Array, Array]:
        left, right = self.cranks
        pivot = np.array([self.base, 0.0])
        return left.length * directions(q1), pivot + right.length * directions(q2)

    def _side(self, k: int, link: Link, q: Array, at: Index) -> Motion:
        side = Motion.at_rest(q.size, int(at[-1]))
        side.add(link, q, np.eye(int(at[-1]))[[k]], at[k])
        return side


@typed
def mechanism_inertia(
    mechanism: Mechanism,
    drives: tuple[str, str],
    *,
    angles: npt.ArrayLike = (0.0, 0.0),
    elastic: Literal["held", "free"] = "held",
) -> Array:
    """(2, 2) generalised inertia of a mechanism that two drives move [kg m^2], from constraints.

    With the mass matrix M of all bodies, motions N that the joints allow and their drive rates E,
    it is the inverse of E N (N^T M N)^-1 N^T E^T; elastic coordinates held are left out of N.

    Args:
        mechanism: bodies and joints; everything else that moves it is left out.
        drives: names of the two drives.
        angles: (2,) their joint coordinates [rad or m]; with a displacement the inertia is mixed
            too.
        elastic: "held" or "free", see `TwoLink.inertia`.

    Raises:
        ConfigError: if a drive is unknown.
        ModelError: if the drives do not determine the motion there, or it cannot be assembled.
    """
    return Driven(mechanism, drives, elastic=elastic).inertia(*np.asarray(angles, dtype=float))


class Driven:
    """Inertia of a `rom.Mechanism` over the coordinates of two drives, for maps and searches.

    Coordinates count from where the bodies were added; every posture is assembled from there, a
    large one in steps.

    Args:
        mechanism: bodies and joints; everything else that moves it is left out.
        drives: names of the two drives.
        tool: name of the body whose frame is the tool, moving in the plane z = const; for a rigid
            body that is its mass centre.
        elastic: "held" or "free", see `TwoLink.inertia`.

    Raises:
        ConfigError: if a drive or the tool is unknown.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        drives: tuple[str, str],
        *,
        tool: str | None = None,
        elastic: Literal["held", "free"] = "held",
    ) -> None:
        self._packed, self.drives = pack(mechanism, whole=True), drives
        rows = [int(k) for name in drives for k in self._packed.rows_of(name)]
        if len(rows) != 2 or not set(drives) <= set(mechanism.drives):
            raise ConfigError(f"{drives!r} must be two of the drives {sorted(mechanism.drives)}.")
        if tool is not None:
            check_known(tool, self._packed.names, f"the tool {tool!r} is none of")
        self._rows, self._tool = np.array(rows), tool
        self._work = workspace(self._packed.system, len(self._packed.signals))
        self._known = lru_cache(KEPT_POSTURES)(self._found)
        self._is_held = one_of("elastic", elastic, ("held", "free")) == "held"

    def inertia(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2, 2) generalised inertia at coordinates (...) [rad or m]; [kg m^2, kg m, kg].

        Raises:
            ModelError: if the drives do not determine the motion there, or it cannot be assembled.
        """
        q1, q2 = both(q1, q2)
        out = [self._known(*q) for q in zip(q1.flat, q2.flat, strict=True)]
        for found in out:
            if isinstance(found, ModelError):
                raise found
        return np.array(out).reshape(*q1.shape, 2, 2)

    def tip(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2) where the tool is in the plane z = const [m]; q1 and q2 in [rad or m].

        Raises:
            ConfigError, ModelError: without a tool; as `inertia`.
        """
        if self._tool is None:
            raise ConfigError("no tool was named; write Driven(mechanism, drives, tool=...).")
        q1, q2 = both(q1, q2)
        at = self._packed.system.bodies.q_at[self._packed.names.index(self._tool)]
        places = [self._posture(q)[at : at + 2] for q in zip(q1.flat, q2.flat, strict=True)]
        return np.array(places).reshape(*q1.shape, 2)

    def assembles(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """(...) whether there is an inertia at coordinates (...) [rad or m]."""
        q1, q2 = both(q1, q2)
        known = (self._known(*q) for q in zip(q1.flat, q2.flat, strict=True))
        return np.array([not isinstance(x, ModelError) for x in known], bool).reshape(q1.shape)

    def _found(self, q1: float, q2: float) -> Array | ModelError:
        """Inertia (2, 2), or why there is none."""
        try:
            return self._of(self._posture((q1, q2)))
        except ModelError as error:
            return error

    def _posture(self, coordinates: npt.ArrayLike) -> Array:
        """All coordinates of the bodies, followed from where they were added."""
        W, rows, q = self._work, self._packed.system.rows, self._packed.q
        far = np.abs(coordinates) / self._packed.row_scale[self._rows]
        steps = max(1, int(np.ceil(far.max() / MAX_FOLLOWED)))
        for share in np.arange(1, steps + 1) / steps:
            W.signal[rows.signal[self._rows], 0] = share * np.asarray(coordinates)
            q = assembled(self._packed, W, q)
        return q

    def _of(self, q: Array) -> Array:
        W, s = self._work, self._packed.system
        linearize_constraints(s, W, q, np.zeros(self._packed.v.size))
        size = np.sqrt(np.diag(W.S))
        held = np.zeros((0, size.size))
        if self._is_held:
            starts = zip(s.bodies.v_at, s.bodies.r, strict=True)
            held = np.eye(size.size)[[t + 6 + k for t, r in starts for k in range(r)]]
        G = np.vstack([np.delete(W.G, self._rows, axis=0) / size, held])
        G /= np.maximum(np.linalg.norm(G, axis=1, keepdims=True), 1e-300)
        N = null_space(G, rcond=1e-9) / size[:, None]
        E = W.G[self._rows] @ N
        mobility = E @ np.linalg.solve(N.T @ W.S @ N, E.T)
        if (self._is_held and N.shape[1] != 2) or np.linalg.cond(mobility) > 1e12:
            text = f"with elastic coordinates held the joints leave {N.shape[1]} motions to drives"
            raise ModelError(f"{text} {self.drives!r}: needed are two, and no singular position.")
        return np.linalg.inv(mobility)
