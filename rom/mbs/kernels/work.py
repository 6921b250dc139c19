"""Memory for what is computed of a system at one instant, and over a time step."""

from functools import cache
from typing import Annotated, get_args, get_type_hints

import numpy as np
from numba import types

from rom.mbs.kernels.stages import link
from rom.mbs.kernels.system import System
from rom.mbs.kernels.tables import Array1, Array2, Array3, Index1, Table, table

# velocities and multipliers up to which there is memory for whole matrices beside the blocks, in
# case that a block of a body or joint is singular for itself
LARGEST_WHOLE = 2000
# entries of Step.count
STEPS, ITERATIONS, FACTORISATIONS, LAST_ITERATIONS, HAS_FACTOR, STEP_PASSES = range(6)
STEPS_BEFORE, USES_LAWS, LAWS_ASKED, BOTH_LEVELS, FACTOR_USES, HALVINGS = range(6, 12)


@table
class Work(Table):
    """Memory for the quantities of one instant; nothing is allocated during a time step.

    In shapes, b bodies have up to R elastic coordinates, those that are ``bent`` displacements of
    second order; k markers, c joint coordinates, p remembered numbers, s signals, n velocities, m
    constraint rows, e renewed elements; other words are explained in `workspace`.
    """

    A: Annotated[Array3, "b 3 3"]  # orientation
    y: Annotated[Array2, "b R"]  # amplitudes of the shapes
    yd: Annotated[Array2, "b R"]  # their rates
    ydd: Annotated[Array2, "b R"]  # their second rates
    Y: Annotated[Array3, "b bent bent"]  # derivative of y by q, of stiffened bodies
    Yd: Annotated[Array3, "b bent bent"]  # that of yd
    Ya: Annotated[Array2, "bent bent"]  # that of ydd
    of_y: Annotated[Array3, "4 one one"]  # mass, damping, stiffness of one body in y, and memory
    pull: Annotated[Array2, "b R"]  # inertia and gravity for each shape
    d: Annotated[Array2, "b 3"]  # first moment
    dd: Annotated[Array2, "b 3"]  # rate of the first moment in the body frame
    J: Annotated[Array3, "b 3 3"]  # inertia about the origin
    SP: Annotated[Array3, "b R 9"]  # integral of rho P phi_k, P the deformed position
    Sd: Annotated[Array3, "b R 9"]  # integral of rho (dP/dt) phi_k
    SPd: Annotated[Array3, "b 3 3"]  # integral of rho P (dP/dt)
    Sa: Annotated[Array2, "R 9"]  # integral of rho (d2P/dt2) phi_k
    T1d: Annotated[Array3, "b R 9"]  # integral of rho X psi_kl dy_l/dt, of what T1 has
    T1a: Annotated[Array2, "R 9"]  # integral of rho X psi_kl y_l
    line: Annotated[Array1, "9R"]  # the rows of a contraction, one after the other
    P: Annotated[Array2, "k 3"]  # marker positions
    E: Annotated[Array3, "k 3 3"]  # marker axes
    V: Annotated[Array2, "k 6"]  # marker twists
    conv: Annotated[Array2, "k 6"]  # marker accelerations at zero accelerations of the coordinates
    H: Annotated[Array3, "k 6 6+R"]  # marker twist as a function of the body velocities
    move: Annotated[Array3, "k 6 R"]  # motion of a marker per elastic rate, body frame
    u: Annotated[Array2, "k 3"]  # marker positions in the body frame
    theta: Annotated[Array2, "k 3"]  # marker rotation vectors
    wrench: Annotated[Array2, "k 6"]  # force and moment on each marker
    load: Annotated[Array1, "1"]  # factor of loads, one but where statics lets them grow
    signal: Annotated[Array2, "s 3"]  # prescribed values, rates, accelerations; or vectors of loads
    x: Annotated[Array1, "c"]  # joint coordinates, angles followed over whole turns
    xd: Annotated[Array1, "c"]  # their rates
    xc: Annotated[Array1, "c"]  # their convective accelerations
    xg: Annotated[Array2, "c 12"]  # their gradients in the twists of their two markers
    value: Annotated[Array1, "m"]  # constraint residual
    g: Annotated[Array2, "m 24"]  # constraint gradient in the twists of its two or four markers
    gamma: Annotated[Array1, "m"]  # convective term of the constraint acceleration
    G: Annotated[Array2, "m wide"]  # constraint gradient in the velocities; or blocks in a row
    base: Annotated[Array1, "c+p"]  # coordinates and memory at the last accepted instant
    fresh: Annotated[Array1, "p"]  # memory of laws, if this instant is accepted
    power: Annotated[Array1, "3"]  # of drives and motors, of forces, lost in dampers and friction
    driven: Annotated[Array1, "1"]  # power of motors
    residual: Annotated[Array1, "n"]  # equations of motion
    S: Annotated[Array2, "tall broad"]  # mass and damping in the iteration matrix; or its blocks
    Kt: Annotated[Array2, "tall broad"]  # as S: stiffness part
    Q: Annotated[Array2, "12 12"]  # stiffness of a pair of markers
    QH: Annotated[Array2, "12 12+2R"]
    lu: Annotated[Array2, "whole whole"]
    factor: Annotated[Array1, "f"]  # the factor by blocks, see rom.mbs.kernels.system.Plan
    by_blocks: Annotated[Index1, "1"]  # whether the factor at hand is the one by blocks
    pivot: Annotated[Index1, "n+m"]
    spare: Annotated[Array1, "n+m"]
    rhs: Annotated[Array1, "n+m"]
    scaling: Annotated[Array1, "n+m"]
    soft: Annotated[Array1, "m"]  # by which constraints give way where some repeat others, scaled
    refined: Annotated[Array2, "2 n+m"]  # two solutions before
    weight: Annotated[Array1, "n"]  # mass weights of the norm of increments
    U: Annotated[Array2, "m_whole m_whole"]  # range of the constraints, leading rows
    U_lu: Annotated[Array2, "m_whole m_whole"]  # the range that is built into lu
    UG: Annotated[Array2, "m wide"]  # U_lu^T G, leading rows
    UGT: Annotated[Array2, "m wide"]  # the same in increments of the rotation vectors of a step
    remainder: Annotated[Array2, "n_whole m_whole"]
    part: Annotated[Array1, "m"]
    pairs: Annotated[Array3, "e 6 6"]  # renewed tangents of elements by the motion of i against j
    pairs_lu: Annotated[Array3, "e 6 6"]  # the same as it is in lu
    approach: Annotated[Array2, "6e n"]  # that motion per velocity, at the factorisation
    response: Annotated[Array2, "6e n+m"]  # solutions for its rows
    yielding: Annotated[Array2, "6e 6e"]  # approach times response
    renewal: Annotated[Array2, "6e 6e"]  # factors of 1 + (pairs - pairs_lu) yielding
    renewal_pivot: Annotated[Index1, "6e"]
    renewal_part: Annotated[Array1, "6e"]
    has_response: Annotated[Index1, "1"]  # whether `response` belongs to the factor at hand
    delta: Annotated[Array1, "n"]  # increment
    dlam: Annotated[Array1, "m"]  # increment of the multipliers


@table
class Step(Table):
    """State, the trial state of the step under way, and the method."""

    q: Array1  # coordinates at the last accepted instant
    v: Array1  # velocities then
    a: Array1  # algorithmic accelerations
    vd: Array1  # true accelerations
    lam: Array1  # multipliers
    q1: Array1  # trial values of the same
    v1: Array1
    vd1: Array1
    lam1: Array1
    psi: Array1  # (n,) increment of the step
    work: Array1  # (3,) work done since the start, by drives, by applied forces, lost in dampers
    lost: Array1  # (3,) the powers at the last accepted instant
    # (12,) steps, iterations, factorisations, iterations of the last step, whether a factorisation
    # is at hand, pass of the present step, steps when the present chunk began, whether Python
    # forces are to be asked for, whether they have been, whether constraints hold for positions and
    # velocities both, corrections with the factorisation at hand, halvings of the last correction
    count: Index1
    # (6,) norm of the last increment, length of the mechanism, tolerance, total mass, largest gap
    # in a joint before the last increment, imbalance before it once there were many
    size: Array1
    method: Array1  # (5,) h, beta, gamma, alpha_m, alpha_f
    # (order + 1,) weights of the present, last and earlier values in the derivative of BDF, three
    # zeros for generalised-alpha. With three weights ``a`` is the last but one velocity, and
    # ``psi`` the last increment until the next step begins
    bdf: Array1
    # (2, order - 1, n) for BDF of other orders: earlier positions as seen from the last accepted
    # instant, see `rom.mbs.integrate.bdf`, and velocities
    past: Array3
    drift: Array1  # (n,) part of the increment of such a step that closes gaps


def workspace(system: System, n_signals: int) -> Work:
    """Zeroed memory that fits the system, whose stages are linked: no kernel runs without it."""
    link(system)
    bodies, graph, m = system.bodies, system.graph, system.rows.kind.size
    R, bent = bodies.K.shape[1], int((bodies.r * bodies.stiffened).max(initial=0))
    n, c, p = int((6 + bodies.r).sum()), system.coordinates.kind.size, system.memory.size
    tall, broad, wide, whole = n, n, n, n + m
    if graph.compact:
        tall, broad = int(np.repeat(6 + bodies.r, np.diff(graph.first)).sum()), 6 + R
        wide = int((graph.at + 6 + bodies.r[graph.body])[graph.body >= 0].max(initial=0))
        whole = n + m if n + m <= LARGEST_WHOLE else 0
    sizes = {
        **{"b": bodies.mass.size, "k": system.markers.body.size, "s": n_signals},
        **{"R": R, "9R": 9 * R, "6+R": 6 + R, "12+2R": 12 + 2 * R},
        **{"bent": bent, "one": 6 * min(bent, 1) + bent, "c": c, "p": p, "c+p": c + p},
        **{"n": n, "m": m, "n+m": n + m, "f": int(graph.plan.memory[0]), "wide": wide},
        **{"tall": tall, "broad": broad, "whole": whole},
        **{"n_whole": 0 if graph.compact else n, "m_whole": 0 if graph.compact else m},
        **{"e": len(system.renewed), "6e": 6 * len(system.renewed)},
    }
    arrays = {
        name: np.zeros([sizes[x] if x in sizes else int(x) for x in shape.split()], kind.dtype.name)
        for name, (kind, shape) in _fields().items()
    }
    arrays["load"][0] = 1.0
    arrays["base"][c:] = system.memory
    return Work(**arrays)


@cache
def _fields() -> dict[str, tuple[types.Array, str]]:
    """Type and shape of the fields of `Work`."""
    hints = get_type_hints(Work, include_extras=True)
    return {name: get_args(hints[name])[1:] for name in Work._layout}
