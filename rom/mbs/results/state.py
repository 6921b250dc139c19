"""A mechanism at one instant, and what a method remembers beside it."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.errors import ConfigError
from rom.model import Array
from rom.names import named


@dataclass(frozen=True)
class Memory:
    """What an implicit method remembers beside the state: with it, a run goes on bit for bit.

    Attributes:
        method: name of the method.
        h: length of the last step [s].
        origin: time from which steps are counted [s].
        taken: steps since then.
        arrays: the factorised iteration matrix and what belongs to it.
    """

    method: str
    h: float
    origin: float
    taken: int
    arrays: dict[str, Array] = field(repr=False)


@typed
@dataclass(frozen=True)
class State:
    """A mechanism at one instant.

    Attributes:
        t: time [s].
        q: (n_q,) per body: origin (3) [m], quaternion (4) [1], elastic coordinates (r); the origin
            and axes of a flexible body are its mean ones, at large deflection those of its frame.
        v: (n,) per body: velocity of the origin, world (3) [m/s], angular velocity, body frame (3)
            [rad/s], elastic rates (r).
        a: (n,) rates of v [m/s^2, rad/s^2].
        lam: (m,) multipliers of the constraints [N, N m].
        rank: number of independent constraints.
        algorithmic: (n,) acceleration-like variable of generalised-alpha [m/s^2, rad/s^2], None at
            a fresh start.
        base: (c,) joint coordinates that forces or couplings act on [m, rad], angles counted over
            whole turns; None: as measured.
        memory: of the method that arrived here; None at a fresh start.
        closed: largest change of what was given by joints and drives at a fresh start, of the size
            of the mechanism or of given velocities [1].
        in_own_frames: read from a file in which bodies without geometric stiffness stand in the
            frames they were given.
    """

    t: float
    q: Array
    v: Array
    a: Array
    lam: Array
    rank: int
    algorithmic: Array | None = None
    base: Array | None = None
    memory: Memory | None = None
    closed: float = 0.0
    in_own_frames: bool = False


def check_state(state: State, packed: Any, *, joints: bool = True) -> None:
    """Refuse a state of other bodies or joints, or of bodies in frames of an older version.

    Raises:
        ConfigError: with the numbers, or naming the bodies.
    """
    needed = (packed.q.size, packed.v.size, packed.system.rows.kind.size)
    sizes: Any = tuple(np.size(getattr(state, x, 0.0)) for x in ("q", "v", "lam"))
    if not isinstance(state, State) or sizes[: 2 + joints] != needed[: 2 + joints]:
        raise ConfigError(
            f"the state has {sizes[0]} coordinates, {sizes[1]} velocities and {sizes[2]} "
            "constraints; this mechanism has {}, {} and {}: their bodies "
            "differ, or joints.".format(*needed),
            hint="Take a state of the same mechanism: sol.final, or rom.equilibrium.",
        )
    stiffened = dict(zip(packed.names, packed.system.bodies.stiffened, strict=True))
    moved = [marker.body for marker in packed.frames if not stiffened[marker.body]]
    if state.in_own_frames and moved:
        raise ConfigError(
            f"the state counts {named(moved)} in the frame of its reference condition; motions "
            "now are integrated on mean axes, and the two differ by the deformation.",
            hint="Compute the motion up to there again; its file is of an older version.",
        )
