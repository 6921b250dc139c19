"""A mechanism at one instant, and what a method remembers beside it."""

from dataclasses import dataclass, field

from rom.arguments import typed
from rom.model import Array


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
            and axes of a body with geometric stiffness are its mean ones.
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
