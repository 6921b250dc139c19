"""The mechanism as flat arrays, in tables that compiled code understands.

``r`` is the number of elastic coordinates of one body, R the largest one, n the number of
velocities, m the number of constraint rows. Coordinates of a body: position of the origin (3),
quaternion (4), elastic (r). Velocities: of the origin in the world (3), angular velocity in the
body frame (3), elastic (r). A marker twist is velocity (3), then angular velocity (3), world.

Bodies and groups of constraint rows are the nodes of a graph; joints and forces are its edges. An
elimination plan removes one node after the other, leaf to root, so that the work and the memory of
a chain or tree grow with its length only. `rom.mbs.equations.graph` makes both tables, once for a
mechanism.
"""

from rom.mbs.kernels.tables import (
    Address1,
    Address2,
    Array1,
    Array2,
    Array3,
    Array4,
    Index1,
    Index2,
    Table,
    table,
)

# kinds of constraint rows
POINT, ALONG, NORMAL, ANGLE, DISTANCE, COUPLING, TOUCH, ROLL = range(8)
# those that measure lengths; a row of kind ROLL measures a velocity
LENGTHS = (POINT, ALONG, DISTANCE, TOUCH)
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
        H_at: (f,) first entry of a body in H.
        H: (h,) entry r^2 l + r m + k: share of the shape m in psi_kl.
        T1: (f, R, 9 R) row l, entry 9 k + 3 a + b: integral of rho X_a psi_kl,b without those.
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
    H_at: Index1
    H: Array1
    T1: Array3
    gravity: Array1


@table
class Markers(Table):
    """Points with axes on bodies: P = r + A (x + shape q + q bend q / 2), axes A exp(twist q).

    Fitted markers have the axes A R, R the rotation nearest to their covariance.

    Attributes:
        body: (k,) body, -1 for the ground.
        point: (k, 3) undeformed position in the body frame [m].
        shape: (k, 3, R) displacement per elastic coordinate.
        twist: (k, 3, R) small rotation per elastic coordinate.
        bend: (k, 6, R, R) displacement and rotation of second order, of stiffened bodies.
        fit: (k,) row of fitted markers in their table, -1 for others.
        covariance: (f, 9, 1 + R) entry 3 a + b: see `rom.body.records.Marker`.
    """

    body: Index1
    point: Array2
    shape: Array3
    twist: Array3
    bend: Array4
    fit: Index1
    covariance: Array3


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
class Plan(Table):
    """Elimination of k nodes, each coupled to later nodes with c unknowns together.

    The factor is one vector. Of each node it holds the pivot (d, d), the block to its right
    (d, c) and the block below (c, d), all by rows.

    Attributes:
        position: (n + m,) place of each velocity and multiplier in the order of elimination.
        size, wide: (k,) numbers d and c of each node; start: (k,) its first place.
        pivot, right, below: (k,) where its blocks begin in the factor.
        next_first: (k + 1,), next: later nodes coupled to each node; shift: their first columns.
        pair_first: (k,), target, stride: where a product of two of them is subtracted, and the
            distance of its rows.
        block_to, block_stride: (e,) the same for the blocks of two bodies.
        corner: (m,) where the entry of a multiplier by itself stands.
        row_to, row_back, row_stride: (m, 4) where the gradient of a constraint row goes, as a row
            and as a column, and the distance of the entries of the column.
        memory: (1,) length of the factor.
    """

    position: Index1
    size: Index1
    wide: Index1
    start: Index1
    pivot: Index1
    right: Index1
    below: Index1
    next_first: Index1
    next: Index1
    shift: Index1
    pair_first: Index1
    target: Index1
    stride: Index1
    block_to: Index1
    block_stride: Index1
    corner: Index1
    row_to: Index2
    row_back: Index2
    row_stride: Index2
    memory: Index1


@table
class Graph(Table):
    """Where the entries of two bodies, or of a row and a body, are stored.

    Attributes:
        compact: 1 if only blocks are stored and eliminated by the plan, 0 for whole matrices.
        shares: 1 if constraints in blocks may repeat others: each of them gives way a little.
        first: (b + 1,), other: (e,) bodies that each body is coupled to, itself included,
            ascending; x, y: (e,) first row and column of their block in Work.S and Work.Kt.
        own: (b,) block of each body with itself.
        body: (m, 4) different bodies that a constraint row moves, -1 for none; at: (m, 4) their
            first column in Work.G.
        joint_first: (p + 1,), joint_rows: (m,) constraint rows of each joint.
        plan: of the elimination; empty for whole matrices.
    """

    compact: int
    shares: int
    first: Index1
    other: Index1
    x: Index1
    y: Index1
    own: Index1
    body: Index2
    at: Index2
    joint_first: Index1
    joint_rows: Index1
    plan: Plan


@table
class System(Table):
    """Everything that stays constant during a run.

    Attributes:
        stages: addresses of the stages, first of all.
        elements: (e, 5) of each family of elements that occurs, see
            `rom.mbs.kernels.element_calls`.
        by_multipliers: 1 if forces depend on the loads of joints.
        memory: (p,) what laws remember from one instant to the next, at the start.
        renewed: (k, 2) markers i and j of elements whose tangents are renewed within a step,
            see `rom.mbs.equations.renewal`.
    """

    stages: Address1
    bodies: Bodies
    markers: Markers
    rows: Rows
    coordinates: Coordinates
    elements: Address2
    by_multipliers: int
    memory: Array1
    renewed: Index2
    graph: Graph | None = None
