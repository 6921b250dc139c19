"""Memory for what is computed of a system at one instant, and over a time step."""

import numpy as np

from rom.mbs.kernels.stages import link
from rom.mbs.kernels.system import System
from rom.mbs.kernels.tables import Array1, Array2, Array3, Index1, Table, table

# velocities and multipliers up to which there is memory for whole matrices beside the blocks, in
# case that a block of a body or joint is singular for itself
LARGEST_WHOLE = 2000
# entries of Step.count
(
    STEPS,
    ITERATIONS,
    FACTORISATIONS,
    LAST_ITERATIONS,
    HAS_FACTOR,
    STEP_PASSES,
    STEPS_BEFORE,
    USES_LAWS,
    LAWS_ASKED,
    BOTH_LEVELS,
    FACTOR_USES,
    HALVINGS,
) = range(12)


@table
class Work(Table):
    """Memory for the quantities of one instant; nothing is allocated during a time step."""

    A: Array3  # (b, 3, 3) orientation
    y: Array2  # (b, R) amplitudes of the shapes
    yd: Array2  # (b, R) their rates
    ydd: Array2  # (b, R) their second rates
    Y: Array3  # (b, R, R) derivative of y by q, of stiffened bodies
    Yd: Array3  # (b, R, R) that of yd
    Ya: Array2  # (R, R) that of ydd
    of_y: Array3  # (4, 6 + R, 6 + R) mass, damping, stiffness of one body in y, and memory
    pull: Array2  # (b, R) inertia and gravity for each shape
    d: Array2  # (b, 3) first moment
    dd: Array2  # (b, 3) rate of the first moment in the body frame
    J: Array3  # (b, 3, 3) inertia about the origin
    SP: Array3  # (b, R, 9) integral of rho P phi_k, P the deformed position
    Sd: Array3  # (b, R, 9) integral of rho (dP/dt) phi_k
    SPd: Array3  # (b, 3, 3) integral of rho P (dP/dt)
    Sa: Array2  # (R, 9) integral of rho (d2P/dt2) phi_k
    T1d: Array3  # (b, R, 9) integral of rho X psi_kl dy_l/dt, of what T1 has
    T1a: Array2  # (R, 9) integral of rho X psi_kl y_l
    line: Array1  # (9 R,) the rows of a contraction, one after the other
    P: Array2  # (k, 3) marker positions
    E: Array3  # (k, 3, 3) marker axes
    V: Array2  # (k, 6) marker twists
    conv: Array2  # (k, 6) marker accelerations at zero accelerations of the coordinates
    H: Array3  # (k, 6, 6 + R) marker twist as a function of the body velocities
    move: Array3  # (k, 6, R) displacement and rotation of a marker per elastic rate, body frame
    u: Array2  # (k, 3) marker positions in the body frame
    theta: Array2  # (k, 3) marker rotation vectors
    wrench: Array2  # (k, 6) force and moment on each marker
    load: Array1  # (1,) factor of loads, one but where statics lets them grow
    signal: Array2  # (s, 3) prescribed values, rates, accelerations; or vectors of loads
    x: Array1  # (c,) joint coordinates, angles followed over whole turns
    xd: Array1  # (c,) their rates
    xc: Array1  # (c,) their convective accelerations
    xg: Array2  # (c, 12) their gradients in the twists of their two markers
    value: Array1  # (m,) constraint residual
    g: Array2  # (m, 24) constraint gradient in the twists of its two or four markers
    gamma: Array1  # (m,) convective term of the constraint acceleration
    G: Array2  # (m, n) constraint gradient in the velocities; blocks in a row if they are stored
    base: Array1  # (c + p,) joint coordinates and memory of laws at the last accepted instant
    fresh: Array1  # (p,) memory of laws, if this instant is accepted
    power: Array1  # (3,) of drives and motors, of forces, lost in dampers and friction
    driven: Array1  # (1,) power of motors
    residual: Array1  # (n,) equations of motion
    S: Array2  # (n, n) mass and damping part of the iteration matrix; or blocks below each other
    Kt: Array2  # as S: stiffness part
    Q: Array2  # (12, 12) stiffness of a pair of markers
    QH: Array2  # (12, 12 + 2 R)
    lu: Array2  # (n + m, n + m)
    factor: Array1  # the factor by blocks, see rom.mbs.kernels.system.Plan
    by_blocks: Index1  # (1,) whether the factor at hand is the one by blocks
    pivot: Index1  # (n + m,)
    spare: Array1  # (n + m,)
    rhs: Array1  # (n + m,)
    scaling: Array1  # (n + m,)
    soft: Array1  # (m,) by which each constraint gives way where some repeat others, scaled
    refined: Array2  # (2, n + m) two solutions before
    weight: Array1  # (n,) mass weights of the norm of increments
    U: Array2  # (m, m) range of the constraints, leading rows
    U_lu: Array2  # (m, m) the range that is built into lu
    UG: Array2  # (m, n) U_lu^T G, leading rows
    UGT: Array2  # (m, n) the same in increments of the rotation vectors of a step
    remainder: Array2  # (n, m)
    part: Array1  # (m,)
    pairs: Array3  # (e, 6, 6) renewed tangents of elements by the motion of i against j
    pairs_lu: Array3  # (e, 6, 6) the same as it is in lu
    approach: Array2  # (6 e, n) that motion per velocity, at the factorisation
    response: Array2  # (6 e, n + m) solutions for its rows
    yielding: Array2  # (6 e, 6 e) approach times response
    renewal: Array2  # (6 e, 6 e) factors of 1 + (pairs - pairs_lu) yielding
    renewal_pivot: Index1  # (6 e,)
    renewal_part: Array1  # (6 e,)
    has_response: Index1  # (1,) whether `response` belongs to the factor at hand
    delta: Array1  # (n,) increment
    dlam: Array1  # (m,) increment of the multipliers


@table
class Step(Table):
    """State, the trial state of the step under way, and the method.

    Attributes:
        q, v, a, vd, lam: coordinates, velocities, algorithmic and true accelerations,
            multipliers at the last accepted instant.
        q1, v1, vd1, lam1: the trial values; psi: (n,) increment of the step.
        work: (3,) work done since the start, by drives, by applied forces, lost in dampers.
        lost: (3,) the powers at the last accepted instant.
        count: (12,) steps, iterations, factorisations, iterations of the last step, whether a
            factorisation is at hand, pass of the present step, steps when the present chunk
            began, whether Python forces are to be asked for, whether they have been, whether
            constraints hold for positions and velocities both, corrections with the factorisation
            at hand, halvings of the last correction.
        size: (6,) norm of the last increment, length of the mechanism, tolerance, total mass,
            largest gap in a joint before the last increment, imbalance before it once there were
            many.
        method: (5,) h, beta, gamma, alpha_m, alpha_f.
        bdf: (order + 1,) weights of the present, last and earlier values in the derivative of
            BDF, three zeros for generalised-alpha. With three weights ``a`` is the last but one
            velocity, and ``psi`` the last increment until the next step begins.
        past: (2, order - 1, n) for BDF of other orders: earlier positions as seen from the last
            accepted instant, see `rom.mbs.integrate.bdf`, and velocities.
        drift: (n,) part of the increment of such a step that closes gaps.
    """

    q: Array1
    v: Array1
    a: Array1
    vd: Array1
    lam: Array1
    q1: Array1
    v1: Array1
    vd1: Array1
    lam1: Array1
    psi: Array1
    work: Array1
    lost: Array1
    count: Index1
    size: Array1
    method: Array1
    bdf: Array1
    past: Array3
    drift: Array1


def workspace(system: System, n_signals: int) -> Work:
    """Zeroed memory that fits the system, whose stages are linked: no kernel runs without it."""
    link(system)
    bodies, markers, rows = system.bodies, system.markers, system.rows
    b, k, m, c = bodies.mass.size, markers.body.size, rows.kind.size, system.coordinates.kind.size
    R, bent = bodies.K.shape[1], int((bodies.r * bodies.stiffened).max(initial=0))
    n = int(6 * b + bodies.r.sum())
    e, square, wide, whole = len(system.renewed), (n, n), n, n + m
    if system.graph.compact:
        square = (int(np.repeat(6 + bodies.r, np.diff(system.graph.first)).sum()), 6 + R)
        moved = system.graph.body
        wide = int((system.graph.at + 6 + bodies.r[moved])[moved >= 0].max(initial=0))
        whole = n + m if n + m <= LARGEST_WHOLE else 0
    redundant = (0, 0) if system.graph.compact else (m, m)
    shapes = {
        **dict.fromkeys(("A", "J", "SPd"), (b, 3, 3)),
        **dict.fromkeys(("d", "dd"), (b, 3)),
        **dict.fromkeys(("SP", "Sd"), (b, R, 9)),
        **dict.fromkeys(("y", "yd", "ydd", "pull"), (b, R)),
        **dict.fromkeys(("Y", "Yd"), (b, *2 * (bent,))),
        "Ya": 2 * (bent,),
        "of_y": (4, *2 * (6 * min(bent, 1) + bent,)),
        "T1d": (b, R, 9),
        **dict.fromkeys(("Sa", "T1a"), (R, 9)),
        "line": (9 * R,),
        "move": (k, 6, R),
        **dict.fromkeys(("P", "u", "theta"), (k, 3)),
        "E": (k, 3, 3),
        **dict.fromkeys(("V", "conv", "wrench"), (k, 6)),
        "H": (k, 6, 6 + R),
        "load": (1,),
        "signal": (n_signals, 3),
        **dict.fromkeys(("value", "gamma", "part", "dlam"), (m,)),
        "g": (m, 24),
        **dict.fromkeys(("x", "xd", "xc"), (c,)),
        "base": (c + system.memory.size,),
        "fresh": (system.memory.size,),
        "xg": (c, 12),
        **dict.fromkeys(("G", "UG", "UGT"), (m, wide)),
        "remainder": (0, 0) if system.graph.compact else (n, m),
        "power": (3,),
        "driven": (1,),
        **dict.fromkeys(("residual", "weight", "delta"), (n,)),
        **dict.fromkeys(("S", "Kt"), square),
        "Q": (12, 12),
        "QH": (12, 12 + 2 * R),
        "lu": (whole, whole),
        "factor": tuple(system.graph.plan.memory),
        **dict.fromkeys(("rhs", "scaling", "spare"), (n + m,)),
        "soft": (m,),
        "refined": (2, n + m),
        **dict.fromkeys(("U", "U_lu"), redundant),
        **dict.fromkeys(("pairs", "pairs_lu"), (e, 6, 6)),
        "approach": (6 * e, n),
        "response": (6 * e, n + m),
        **dict.fromkeys(("yielding", "renewal"), (6 * e, 6 * e)),
        "renewal_part": (6 * e,),
    }
    arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
    arrays["load"][0] = 1.0
    arrays["base"][c:] = system.memory
    lengths = {"pivot": n + m, "by_blocks": 1, "renewal_pivot": 6 * e, "has_response": 1}
    whole_numbers = {name: np.zeros(k, dtype=np.int64) for name, k in lengths.items()}
    return Work(**arrays, **whole_numbers)
