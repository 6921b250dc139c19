"""The mechanism as flat arrays, in tuples that compiled code understands.

``r`` is the number of elastic coordinates of one body, R the largest one, n the number of
velocities, m the number of constraint rows. Coordinates of a body: position of the origin (3),
quaternion (4), elastic (r). Velocities: of the origin in the world (3), angular velocity in the
body frame (3), elastic (r). A marker twist is velocity (3), then angular velocity (3), world.
"""

from typing import NamedTuple

import numpy as np

from rom.mbs.kernels.plan import Graph
from rom.model import Array, Index

# kinds of constraint rows
POINT, ALONG, NORMAL, ANGLE, DISTANCE, COUPLING, TOUCH, ROLL = range(8)
# those that measure lengths; a row of kind ROLL measures a velocity
LENGTHS = (POINT, ALONG, DISTANCE, TOUCH)
# kinds of contacts
PLANE, SPHERE, CYLINDER, BORE, DISC = range(5)
# kinds of loads
FORCE_WORLD, FORCE_BODY, TORQUE_WORLD, TORQUE_BODY = 0, 1, 2, 3
# numbers that the law of a non-linear element may use as memory
LAW_MEMORY_SIZE = 256
# velocities and multipliers up to which there is memory for whole matrices beside the blocks, in
# case that a block of a body or joint is singular for itself
LARGEST_WHOLE = 2000
# columns of the work done since the start
WORK = ("drives", "forces", "damping")


class Bodies(NamedTuple):
    """Inertia, stiffness and damping of all bodies; rigid ones have r = 0.

    Attributes:
        q_at, v_at: (b,) first coordinate and velocity of each body.
        r: (b,) number of elastic coordinates.
        flex: (b,) row in the tables of flexible bodies.
        mass: (b,) [kg].
        first: (b, 3) first moment about the origin [kg m].
        second: (b, 3, 3) integral of rho X X^T [kg m^2].
        S: (f, 3, R) integral of rho phi_k.
        S1: (f, R, 9) integral of rho X_a phi_k,b, entry 3 a + b.
        S2: (f, R, 9 R) row l, entry 9 k + 3 a + b: integral of rho phi_l,a phi_k,b.
        M, K, C: (f, R, R) elastic mass, stiffness, damping.
        stiffened: (b,) 1 for bodies with displacements psi_kl of second order, else 0.
        T: (f, R, 3 R) row l, entry 3 k + a: integral of rho psi_kl,a.
        T1: (f, R, 9 R) row l, entry 9 k + 3 a + b: integral of rho X_a psi_kl,b.
        gravity: (3,) [m/s^2].
    """

    q_at: Index
    v_at: Index
    r: Index
    flex: Index
    mass: Array
    first: Array
    second: Array
    S: Array
    S1: Array
    S2: Array
    M: Array
    K: Array
    C: Array
    stiffened: Index
    T: Array
    T1: Array
    gravity: Array


class Markers(NamedTuple):
    """Points with axes on bodies: P = r + A (x + shape q + q bend q / 2), axes A exp(twist q).

    Attributes:
        body: (k,) body, -1 for the ground.
        point: (k, 3) undeformed position in the body frame [m].
        shape: (k, 3, R) displacement per elastic coordinate.
        twist: (k, 3, R) small rotation per elastic coordinate.
        bend: (k, 6, R, R) displacement and rotation of second order, of stiffened bodies.
    """

    body: Index
    point: Array
    shape: Array
    twist: Array
    bend: Array


class Rows(NamedTuple):
    """Scalar constraints between marker i and marker j.

    Attributes:
        kind: (m,) POINT: world component ``a`` of P_j - P_i; ALONG: component of P_j - P_i along
            the axis ``a`` of i; NORMAL: axis ``a`` of i times axis ``b`` of j; ANGLE: from axis
            ``a`` of i to axis ``b`` of j, turning towards axis ``c`` of i; DISTANCE: length of
            P_j - P_i; COUPLING: sum of two joint coordinates, each times its factor; TOUCH: height
            of the lowest point of a ball, or of a wheel with the axis ``b`` of j, over the plane
            through P_i with the normal ``c`` of i; ROLL: velocity with which that point slides
            over the plane along ``a``.
        i, j: (m,) markers.
        k, l: (m,) markers of the second joint of a coupling, -1 for others.
        a, b, c: (m, 3) unit vectors; b is zero for a ball.
        at: (m, 2) joint coordinates of a coupling, -1 for others.
        factor: (m, 2) factors of a coupling; radius of a ball or wheel.
        offset: (m,) value subtracted.
        signal: (m,) prescribed value subtracted as well, -1 for none.
        pair: (m,) joint the row belongs to.
        joint_i, joint_j: (p,) markers of each joint.
    """

    kind: Index
    i: Index
    j: Index
    k: Index
    l: Index
    a: Array
    b: Array
    c: Array
    at: Index
    factor: Array
    offset: Array
    signal: Index
    pair: Index
    joint_i: Index
    joint_j: Index


class Coordinates(NamedTuple):
    """Joint coordinates that forces or couplings act on.

    Attributes:
        kind: (c,) ALONG or ANGLE; i, j, a, b, c, offset: as in `Rows`.
    """

    kind: Index
    i: Index
    j: Index
    a: Array
    b: Array
    c: Array
    offset: Array


class Forces(NamedTuple):
    """Springs, loads and rotational springs.

    Attributes:
        spring_i, spring_j: (s,) markers.
        spring: (s, 3) stiffness [N/m], damping [N s/m], free length [m].
        load_at: (l,) markers; load_kind: (l,) FORCE_WORLD to TORQUE_BODY; load: (l, 3) vector;
        load_signal: (l,) function of time added to the vector, -1 for none.
        turn_at: (t,) joint coordinates of rotational springs;
        turn: (t, 3) stiffness [N m/rad], damping [N m s/rad], free angle [rad].
    """

    spring_i: Index
    spring_j: Index
    spring: Array
    load_at: Index
    load_kind: Index
    load: Array
    load_signal: Index
    turn_at: Index
    turn: Array


class Actions(NamedTuple):
    """Motors, friction and stops on joint coordinates.

    Attributes:
        motor_at: (k,) joint coordinates; motor: (k,) addresses of compiled laws, 0 for Python.
        clock: (1,) signal that tells the time, -1 for none.
        friction_at: (f,) joint coordinates; friction: (f, 6) constant level [N or N m], level per
            load of the joint [1 or m], share by which the level is higher at rest, speed over
            which that fades, viscous coefficient, speed over which the sign changes.
        load_first, load_count: (f,) constraint rows of the joint.
        stop_at: (l,) joint coordinates; stop: (l, 5) side +1 or -1, limit, stiffness, exponent,
            damping factor [s/m or s/rad].
    """

    motor_at: Index
    motor: Index
    clock: Index
    friction_at: Index
    friction: Array
    load_first: Index
    load_count: Index
    stop_at: Index
    stop: Array


class Bushings(NamedTuple):
    """Springs and dampers in six directions.

    Attributes:
        i, j: (b,) markers.
        frame_i, frame_j: (b, 3, 3) axes of the bushing in those of its markers.
        zero: (b, 3) position of j in these axes without force [m].
        stiffness, damping: (b, 6, 6) translations, then rotations.
        curve: (b, 6) first piece of a force over displacement, -1 for none; pieces: (b, 6).
        piece: (n, 7) lower end, origin, four coefficients of powers, energy at the origin.
    """

    i: Index
    j: Index
    frame_i: Array
    frame_j: Array
    zero: Array
    stiffness: Array
    damping: Array
    curve: Index
    pieces: Index
    piece: Array


class Contacts(NamedTuple):
    """A sphere or disc on marker j that touches something on marker i.

    Attributes:
        kind: (c,) PLANE, SPHERE, CYLINDER, BORE or DISC.
        i, j: (c,) markers.
        e: (c, 3) normal of the plane or axis of the cylinder in the axes of i.
        s: (c, 3) axis of the disc in the axes of j.
        radius: (c, 2) on j, and on i [m].
        law: (c, 5) stiffness, exponent, damping factor [s/m], friction coefficient, speed over
            which friction changes its sign [m/s].
    """

    kind: Index
    i: Index
    j: Index
    e: Array
    s: Array
    radius: Array
    law: Array


class Spread(NamedTuple):
    """Loads spread over bodies.

    Attributes:
        body: (l,) body; world: (l,) 1 if the forces keep their direction in the world, else 0.
        force: (l, 3) sum of the forces f [N].
        first: (l, 9) entry 3 a + b: sum of X_a f_b [N m].
        shapes: (l, R, 9) entry 3 a + b: sum of phi_k,a f_b.
        amplitude: (l,) factor; signal: (l,) function of time added to it, -1 for none.
    """

    body: Index
    world: Index
    force: Array
    first: Array
    shapes: Array
    amplitude: Array
    signal: Index


class Nonlinear(NamedTuple):
    """Elements of non-linear bodies between up to K frames, each with a compiled law.

    Attributes:
        address: (e,) of the laws, see `rom.mbs.elements.nonlinear`.
        count: (e,) number of frames.
        body: (e, K) their bodies, -1 beyond.
        numbers: (e, c) what the law knows of the element.
    """

    address: Index
    count: Index
    body: Index
    numbers: Array


class System(NamedTuple):
    """Everything that stays constant during a run."""

    bodies: Bodies
    markers: Markers
    rows: Rows
    coordinates: Coordinates
    forces: Forces
    actions: Actions
    bushings: Bushings
    contacts: Contacts
    spread: Spread
    nonlinear: Nonlinear
    graph: Graph | None = None


class Work(NamedTuple):
    """Memory for the quantities of one instant; nothing is allocated during a time step."""

    A: Array  # (b, 3, 3) orientation
    Ct: Array  # (b, 3, R) first moment per elastic coordinate
    d: Array  # (b, 3) first moment
    dd: Array  # (b, 3) rate of the first moment in the body frame
    J: Array  # (b, 3, 3) inertia about the origin
    SP: Array  # (b, R, 9) integral of rho P phi_k, P the deformed position
    Sd: Array  # (b, R, 9) integral of rho (dP/dt) phi_k
    SPd: Array  # (b, 3, 3) integral of rho P (dP/dt)
    Sa: Array  # (R, 9) integral of rho (d2P/dt2) phi_k
    Td: Array  # (b, R, 3) integral of rho psi_kl dq_l/dt
    T1d: Array  # (b, R, 9) integral of rho X psi_kl dq_l/dt
    Ta: Array  # (R, 3) integral of rho psi_kl d2q_l/dt2
    T1a: Array  # (R, 9) integral of rho X psi_kl d2q_l/dt2
    line: Array  # (9 R,) the rows of a contraction, one after the other
    P: Array  # (k, 3) marker positions
    E: Array  # (k, 3, 3) marker axes
    V: Array  # (k, 6) marker twists
    conv: Array  # (k, 6) marker accelerations at zero accelerations of the coordinates
    H: Array  # (k, 6, 6 + R) marker twist as a function of the body velocities
    move: Array  # (k, 6, R) displacement and rotation of a marker per elastic rate, body frame
    u: Array  # (k, 3) marker positions in the body frame
    theta: Array  # (k, 3) marker rotation vectors
    wrench: Array  # (k, 6) force and moment on each marker
    user: Array  # (k, 6) force and moment from Python functions
    arm: Array  # (l, 9) sum of positions and forces of spread loads, body frame
    pose: Array  # (e, 13 K) frames of non-linear elements: position, quaternion, velocities
    answer: Array  # (2 + 6 K + 72 K^2,) what the law of an element says
    space: Array  # (LAW_MEMORY_SIZE,) for the laws to use as they like
    signal: Array  # (s, 3) prescribed values, rates, accelerations; or vectors of loads
    x: Array  # (c,) joint coordinates, angles followed over whole turns
    xd: Array  # (c,) their rates
    xc: Array  # (c,) their convective accelerations
    xg: Array  # (c, 12) their gradients in the twists of their two markers
    value: Array  # (m,) constraint residual
    g: Array  # (m, 24) constraint gradient in the twists of its two or four markers
    gamma: Array  # (m,) convective term of the constraint acceleration
    G: Array  # (m, n) constraint gradient in the velocities; blocks in a row if they are stored
    base: Array  # (c,) joint coordinates at the last accepted instant
    power: Array  # (3,) of drives and motors, of forces, lost in dampers and friction
    driven: Array  # (1,) power of motors
    motor: Array  # (k,) forces of motors whose law is in Python
    residual: Array  # (n,) equations of motion
    S: Array  # (n, n) mass and damping part of the iteration matrix; or blocks below each other
    Kt: Array  # as S: stiffness part
    Q: Array  # (12, 12) stiffness of a pair of markers
    QH: Array  # (12, 12 + 2 R)
    lu: Array  # (n + m, n + m)
    factor: Array  # the factor by blocks, see rom.mbs.kernels.plan.Plan
    by_blocks: Index  # (1,) whether the factor at hand is the one by blocks
    pivot: Index  # (n + m,)
    spare: Array  # (n + m,)
    rhs: Array  # (n + m,)
    scaling: Array  # (n + m,)
    weight: Array  # (n,) mass weights of the norm of increments
    U: Array  # (m, m) range of the constraints, leading rows
    U_lu: Array  # (m, m) the range that is built into lu
    UG: Array  # (m, n) U_lu^T G, leading rows
    UGT: Array  # (m, n) the same in increments of the rotation vectors of a step
    remainder: Array  # (n, m)
    part: Array  # (m,)
    delta: Array  # (n,) increment
    dlam: Array  # (m,) increment of the multipliers


def workspace(system: System, n_signals: int) -> Work:
    """Zeroed memory that fits the system."""
    bodies, markers, rows = system.bodies, system.markers, system.rows
    b, k, m, c = bodies.mass.size, markers.body.size, rows.kind.size, system.coordinates.kind.size
    R = bodies.K.shape[1]
    n = int(6 * b + bodies.r.sum())
    square, wide, whole = (n, n), n, n + m
    if system.graph.compact:
        square = (int(np.repeat(6 + bodies.r, np.diff(system.graph.first)).sum()), 6 + R)
        moved = system.graph.body
        wide = int((system.graph.at + 6 + bodies.r[moved])[moved >= 0].max(initial=0))
        whole = n + m if n + m <= LARGEST_WHOLE else 0
    redundant = (0, 0) if system.graph.compact else (m, m)
    e, K = system.nonlinear.body.shape
    shapes = {
        **dict.fromkeys(("A", "J", "SPd"), (b, 3, 3)),
        **dict.fromkeys(("d", "dd"), (b, 3)),
        **dict.fromkeys(("SP", "Sd"), (b, R, 9)),
        "Ct": (b, 3, R),
        "Td": (b, R, 3),
        "T1d": (b, R, 9),
        "Ta": (R, 3),
        **dict.fromkeys(("Sa", "T1a"), (R, 9)),
        "line": (9 * R,),
        "move": (k, 6, R),
        **dict.fromkeys(("P", "u", "theta"), (k, 3)),
        "E": (k, 3, 3),
        **dict.fromkeys(("V", "conv", "wrench", "user"), (k, 6)),
        "H": (k, 6, 6 + R),
        "pose": (e, 13 * K),
        "answer": (2 + 6 * K + 72 * K * K,),
        "space": (LAW_MEMORY_SIZE,),
        "arm": (system.spread.body.size, 9),
        "signal": (n_signals, 3),
        **dict.fromkeys(("value", "gamma", "part", "dlam"), (m,)),
        "g": (m, 24),
        **dict.fromkeys(("x", "xd", "xc", "base"), (c,)),
        "xg": (c, 12),
        **dict.fromkeys(("G", "UG", "UGT"), (m, wide)),
        "remainder": (0, 0) if system.graph.compact else (n, m),
        "power": (3,),
        "driven": (1,),
        "motor": (system.actions.motor_at.size,),
        **dict.fromkeys(("residual", "weight", "delta"), (n,)),
        **dict.fromkeys(("S", "Kt"), square),
        "Q": (12, 12),
        "QH": (12, 12 + 2 * R),
        "lu": (whole, whole),
        "factor": tuple(system.graph.plan.memory),
        **dict.fromkeys(("rhs", "scaling", "spare"), (n + m,)),
        **dict.fromkeys(("U", "U_lu"), redundant),
    }
    arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
    whole_numbers = {"pivot": np.zeros(n + m, dtype=np.int64), "by_blocks": np.zeros(1, int)}
    return Work(**arrays, **whole_numbers)
