"""The mechanism as flat arrays, in tables that compiled code understands.

``r`` is the number of elastic coordinates of one body, R the largest one, n the number of
velocities, m the number of constraint rows. Coordinates of a body: position of the origin (3),
quaternion (4), elastic (r). Velocities: of the origin in the world (3), angular velocity in the
body frame (3), elastic (r). A marker twist is velocity (3), then angular velocity (3), world.
"""

from rom.mbs.kernels.plan import Graph
from rom.mbs.kernels.tables import Array1, Array2, Array3, Array4, Index1, Index2, Table, table

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
# columns of the work done since the start
WORK = ("drives", "forces", "damping")


@table
class Bodies(Table):
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

    q_at: Index1
    v_at: Index1
    r: Index1
    flex: Index1
    mass: Array1
    first: Array2
    second: Array3
    S: Array3
    S1: Array3
    S2: Array3
    M: Array3
    K: Array3
    C: Array3
    stiffened: Index1
    T: Array3
    T1: Array3
    gravity: Array1


@table
class Markers(Table):
    """Points with axes on bodies: P = r + A (x + shape q + q bend q / 2), axes A exp(twist q).

    Attributes:
        body: (k,) body, -1 for the ground.
        point: (k, 3) undeformed position in the body frame [m].
        shape: (k, 3, R) displacement per elastic coordinate.
        twist: (k, 3, R) small rotation per elastic coordinate.
        bend: (k, 6, R, R) displacement and rotation of second order, of stiffened bodies.
    """

    body: Index1
    point: Array2
    shape: Array3
    twist: Array3
    bend: Array4


@table
class Rows(Table):
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

    kind: Index1
    i: Index1
    j: Index1
    k: Index1
    l: Index1
    a: Array2
    b: Array2
    c: Array2
    at: Index2
    factor: Array2
    offset: Array1
    signal: Index1
    pair: Index1
    joint_i: Index1
    joint_j: Index1


@table
class Coordinates(Table):
    """Joint coordinates that forces or couplings act on.

    Attributes:
        kind: (c,) ALONG or ANGLE; i, j, a, b, c, offset: as in `Rows`.
    """

    kind: Index1
    i: Index1
    j: Index1
    a: Array2
    b: Array2
    c: Array2
    offset: Array1


@table
class Forces(Table):
    """Springs, loads and rotational springs.

    Attributes:
        spring_i, spring_j: (s,) markers.
        spring: (s, 3) stiffness [N/m], damping [N s/m], free length [m].
        load_at: (l,) markers; load_kind: (l,) FORCE_WORLD to TORQUE_BODY; load: (l, 3) vector;
        load_signal: (l,) function of time added to the vector, -1 for none.
        turn_at: (t,) joint coordinates of rotational springs;
        turn: (t, 3) stiffness [N m/rad], damping [N m s/rad], free angle [rad].
    """

    spring_i: Index1
    spring_j: Index1
    spring: Array2
    load_at: Index1
    load_kind: Index1
    load: Array2
    load_signal: Index1
    turn_at: Index1
    turn: Array2


@table
class Actions(Table):
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

    motor_at: Index1
    motor: Index1
    clock: Index1
    friction_at: Index1
    friction: Array2
    load_first: Index1
    load_count: Index1
    stop_at: Index1
    stop: Array2


@table
class Bushings(Table):
    """Springs and dampers in six directions.

    Attributes:
        i, j: (b,) markers.
        frame_i, frame_j: (b, 3, 3) axes of the bushing in those of its markers.
        zero: (b, 3) position of j in these axes without force [m].
        stiffness, damping: (b, 6, 6) translations, then rotations.
        curve: (b, 6) first piece of a force over displacement, -1 for none; pieces: (b, 6).
        piece: (n, 7) lower end, origin, four coefficients of powers, energy at the origin.
    """

    i: Index1
    j: Index1
    frame_i: Array3
    frame_j: Array3
    zero: Array2
    stiffness: Array3
    damping: Array3
    curve: Index2
    pieces: Index2
    piece: Array2


@table
class Contacts(Table):
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

    kind: Index1
    i: Index1
    j: Index1
    e: Array2
    s: Array2
    radius: Array2
    law: Array2


@table
class Spread(Table):
    """Loads spread over bodies.

    Attributes:
        body: (l,) body; world: (l,) 1 if the forces keep their direction in the world, else 0.
        force: (l, 3) sum of the forces f [N].
        first: (l, 9) entry 3 a + b: sum of X_a f_b [N m].
        shapes: (l, R, 9) entry 3 a + b: sum of phi_k,a f_b.
        amplitude: (l,) factor; signal: (l,) function of time added to it, -1 for none.
    """

    body: Index1
    world: Index1
    force: Array2
    first: Array2
    shapes: Array3
    amplitude: Array1
    signal: Index1


@table
class Nonlinear(Table):
    """Elements of non-linear bodies between up to K frames, each with a compiled law.

    Attributes:
        address: (e,) of the laws, see `rom.mbs.elements.nonlinear`.
        count: (e,) number of frames.
        body: (e, K) their bodies, -1 beyond.
        numbers: (e, c) what the law knows of the element.
    """

    address: Index1
    count: Index1
    body: Index2
    numbers: Array2


@table
class System(Table):
    """Everything that stays constant during a run; first the addresses of the stages."""

    stages: Index1
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
