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
    """Inertia, stiffness and damping of all bodies; rigid ones have r = 0."""

    q_at: Index1  # (b,) first coordinate of each body
    v_at: Index1  # (b,) first velocity of each body
    r: Index1  # (b,) number of elastic coordinates
    flex: Index1  # (b,) row in the tables of flexible bodies
    mass: Array1  # (b,) [kg]
    first: Array2  # (b, 3) first moment about the origin [kg m]
    second: Array3  # (b, 3, 3) integral of rho X X^T [kg m^2]
    S: Array3  # (f, 3, R) integral of rho phi_k
    S1: Array3  # (f, R, 9) integral of rho X_a phi_k,b, entry 3 a + b
    S2: Array3  # (f, R, 9 R) row l, entry 9 k + 3 a + b: integral of rho phi_l,a phi_k,b
    M: Array3  # (f, R, R) elastic mass, as K stiffness and C damping
    K: Array3
    C: Array3
    stiffened: Index1  # (b,) 1 for bodies with displacements psi_kl of second order, else 0
    H_at: Index1  # (f,) first entry of a body in H
    H: Array1  # (h,) entry r^2 l + r m + k: share of the shape m in psi_kl
    T1: Array3  # (f, R, 9 R) row l, entry 9 k + 3 a + b: integral of rho X_a psi_kl,b without those
    gravity: Array1  # (3,) [m/s^2]


@table
class Markers(Table):
    """Points with axes on bodies: P = r + A (x + shape q + q bend q / 2), axes A exp(twist q).

    Fitted markers have the axes A R, R the rotation nearest to their covariance.
    """

    body: Index1  # (k,) body, -1 for the ground
    point: Array2  # (k, 3) undeformed position in the body frame [m]
    shape: Array3  # (k, 3, R) displacement per elastic coordinate
    twist: Array3  # (k, 3, R) small rotation per elastic coordinate
    bend: Array4  # (k, 6, R, R) displacement and rotation of second order, of stiffened bodies
    fit: Index1  # (k,) row of fitted markers in their table, -1 for others
    covariance: Array3  # (f, 9, 1 + R) entry 3 a + b: see `rom.body.records.Marker`


@table
class Rows(Table):
    """Scalar constraints between marker i and marker j."""

    # POINT: world component ``a`` of P_j - P_i; ALONG: component of P_j - P_i along the axis
    # ``a`` of i; NORMAL: axis ``a`` of i times axis ``b`` of j; ANGLE: from axis ``a`` of i to axis
    # ``b`` of j, turning towards axis ``c`` of i; DISTANCE: length of P_j - P_i; COUPLING: sum of
    # two joint coordinates, each times its factor; TOUCH: height of the lowest point of a ball, or
    # of a wheel with the axis ``b`` of j, over the plane through P_i with the normal ``c`` of i;
    # ROLL: velocity with which that point slides over the plane along ``a``
    kind: Index1  # (m,)
    i: Index1  # (m,) marker
    j: Index1  # (m,) other marker
    k: Index1  # (m,) marker of the second joint of a coupling, -1 for others
    l: Index1  # (m,) other marker of that joint
    a: Array2  # (m, 3) unit vector
    b: Array2  # (m, 3) unit vector; zero for a ball
    c: Array2  # (m, 3) unit vector
    at: Index2  # (m, 2) joint coordinates of a coupling, -1 for others
    factor: Array2  # (m, 2) factors of a coupling; radius of a ball or wheel
    offset: Array1  # (m,) value subtracted
    signal: Index1  # (m,) prescribed value subtracted as well, -1 for none
    pair: Index1  # (m,) joint the row belongs to
    joint_i: Index1  # (p,) marker of each joint
    joint_j: Index1  # (p,) other marker


@table
class Coordinates(Table):
    """Joint coordinates that forces or couplings act on."""

    kind: Index1  # (c,) ALONG or ANGLE; the rest as in `Rows`
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
    """

    position: Index1  # (n + m,) place of each velocity and multiplier in the order of elimination
    size: Index1  # (k,) number d of each node
    wide: Index1  # (k,) number c
    start: Index1  # (k,) its first place
    pivot: Index1  # (k,) where its block (d, d) begins in the factor
    right: Index1  # (k,) where its block (d, c) does
    below: Index1  # (k,) where its block (c, d) does
    next_first: Index1  # (k + 1,) where those of each node begin in next and shift
    next: Index1  # the later nodes coupled to each node
    shift: Index1  # and their first columns
    pair_first: Index1  # (k,) where those of each node begin in target and stride
    target: Index1  # the places at which a product of two of them is subtracted
    stride: Index1  # and the distances of its rows
    block_to: Index1  # (e,) the places for the blocks of two bodies
    block_stride: Index1  # (e,) and the distances of their rows
    corner: Index1  # (m,) where the entry of a multiplier by itself stands
    row_to: Index2  # (m, 4) where the gradient of a constraint row goes, as a row
    row_back: Index2  # (m, 4) and as a column
    row_stride: Index2  # (m, 4) distance of the entries of the column
    memory: Index1  # (1,) length of the factor


@table
class Graph(Table):
    """Where the entries of two bodies, or of a row and a body, are stored."""

    compact: int  # 1 if only blocks are stored and eliminated by the plan, 0 for whole matrices
    shares: int  # 1 if constraints in blocks may repeat others: each of them gives way a little
    first: Index1  # (b + 1,) where the pairs of each body begin
    other: Index1  # (e,) bodies that it is coupled to, itself included, ascending
    x: Index1  # (e,) first row of their block in Work.S and Work.Kt
    y: Index1  # (e,) first column
    own: Index1  # (b,) block of each body with itself
    body: Index2  # (m, 4) different bodies that a constraint row moves, -1 for none
    at: Index2  # (m, 4) their first column in Work.G
    joint_first: Index1  # (p + 1,) where the rows of each joint begin
    joint_rows: Index1  # (m,) constraint rows of the joints
    plan: Plan  # of the elimination; empty for whole matrices


@table
class System(Table):
    """Everything that stays constant during a run."""

    stages: Address1  # addresses of the stages, first of all
    bodies: Bodies
    markers: Markers
    rows: Rows
    coordinates: Coordinates
    # (e, 5) of each family of elements that occurs, see `rom.mbs.kernels.element_calls`
    elements: Address2
    by_multipliers: int  # 1 if forces depend on the loads of joints
    memory: Array1  # (p,) what laws remember from one instant to the next, at the start
    # (k, 2) markers i and j of elements whose tangents are renewed within a step, see
    # `rom.mbs.equations.renewal`
    renewed: Index2
    graph: Graph | None = None
