"""Forces along joint coordinates: the coordinate is the place where they act, a law says how hard.

Rotational springs, stops, frictions and motors are such forces, with one table and one set of
kernels. A law says of a coordinate x and its rate: the force; its derivatives by x, by the rate,
and by the load of the joint; the power lost; the energy stored.
"""

import math
from collections.abc import Mapping
from functools import partial
from typing import Annotated

import numpy as np
from numba import types
from numba.extending import intrinsic

from rom.mbs.compiler.calls import called
from rom.mbs.elements.family import (
    Element,
    Family,
    Places,
    apart,
    integers,
    on_joint,
    rows_of,
    starts,
)
from rom.mbs.elements.law_calls import DIFFERENCE_STEP
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import column_of
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.element_calls import energy, multiplier_columns, residuals, tangents
from rom.mbs.kernels.system import ALONG, POINT
from rom.mbs.kernels.tables import (
    PASSING_MARK,
    Address1,
    Array1,
    Array2,
    Index1,
    Scratch1,
    Scratch2,
    Table,
    table,
)

LINEAR, STOP, FRICTION, MOTOR = range(4)  # kinds of laws
NO_PROGRAM = np.zeros(0)


@table
class JointForces(Table):
    """All forces of one kind along joint coordinates."""

    at: Index1  # (f,) joint coordinates
    law: Array2  # (f, n) numbers of the law of that kind, see there
    load_first: Address1  # (f,) first constraint row of the joint, for laws that ask for its load
    load_count: Address1  # (f,) number of them
    address: Address1  # (f,) of compiled laws of the user, 0 for Python
    # (f + 1,) where the programs of formulas begin; equal numbers for other laws
    program_at: Address1
    programs: Scratch1  # (p,) of all formulas
    clock: Address1  # (1,) function that tells the time
    kind: Annotated[int, PASSING_MARK]  # of the laws
    formula: Scratch1  # (3,) what the formula at hand gives: force, and its derivatives
    answer: Scratch1  # (f,) forces at the last residual; those of laws in Python before it
    slope: Scratch2  # (f, 2) derivatives of laws in Python by coordinate and rate


@table
class Frictions(JointForces):
    """Those whose joint tells one mechanism from another beyond the coordinate."""

    load_first: Index1
    load_count: Index1


@table
class Motors(JointForces):
    """Those that formulas tell from another, not numbers."""

    law: Scratch2
    program_at: Index1
    programs: Array1
    clock: Index1


def pack(
    made: type[JointForces], kind: int, elements: Mapping[str, Element], places: Places
) -> JointForces:
    """The table, of class ``made``, of all forces with a kind of laws.

    They have a ``joint`` and the numbers of their ``laws``; they may have a ``row``, if it is not
    the angle of the joint, and ``address`` and ``program`` of a law.
    """
    found = [(one, law) for one in elements.values() for law in one.laws]
    forces, laws = zip(*found, strict=True)
    programs = [getattr(one, "program", NO_PROGRAM) for one in forces]
    count = places.owners.count if kind == FRICTION else lambda _: 0
    n = len(forces)
    return made(
        integers(
            places.coordinate(one.joint, getattr(one, "row", places.joints[one.joint].turn))
            for one in forces
        ),
        rows_of(laws, len(laws[0])) if laws[0] else np.zeros((n, 0)),
        integers(places.owners.index(one.joint) if count(one.joint) else 0 for one in forces),
        integers(count(one.joint) for one in forces),
        integers(getattr(one, "address", 0) for one in forces),
        starts([program.size for program in programs]),
        np.concatenate(programs),
        integers([places.clock() if kind == MOTOR else -1]),
        kind,
        np.zeros(3),
        np.zeros(n),
        np.zeros((n, 2)),
    )


@inner
def linear(law, x, rate):
    """Spring and damper: stiffness, damping, coordinate without force."""
    k, c, stretch = law[0], law[1], x - law[2]
    return -k * stretch - c * rate, -k, -c, 0.0, c * rate * rate, 0.5 * k * stretch**2


@inner
def stop(law, x, rate):
    """Stop: side +1 or -1, limit, stiffness, exponent, damping factor [s/m or s/rad]."""
    side, exponent = law[0], law[3]
    depth, speed = side * (x - law[1]), side * rate
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    elastic = law[2] * depth**exponent
    grip = max(1.0 + law[4] * speed, 0.0)
    force, stiffness = -side * elastic * grip, exponent * elastic / depth * grip
    damping = elastic * law[4] if grip > 0.0 else 0.0
    lost = -(force + side * elastic) * rate
    stored = law[2] * depth ** (exponent + 1.0) / (exponent + 1.0)
    return force, -stiffness, -damping, 0.0, lost, stored


@inner
def friction(law, load, rate):
    """Friction, with Stribeck's rise towards rest.

    Numbers: constant level [N or N m], level per load of the joint [1 or m], share by which the
    level is higher at rest, speed over which that fades, viscous coefficient, speed over which the
    sign changes.
    """
    level, sign = law[0] + law[1] * load, math.tanh(rate / law[5])
    fade = law[2] * math.exp(-((rate / law[3]) ** 2))
    slope = (1.0 - sign * sign) / law[5] * (1.0 + fade) - 2.0 * rate / law[3] ** 2 * sign * fade
    shape = sign * (1.0 + fade)
    force = -level * shape - law[4] * rate
    return force, 0.0, -level * slope - law[4], -law[1] * shape, -force * rate, 0.0


@intrinsic
def call(_context, address, time, x, rate):
    """Value of the compiled law at an address: double (double, double, double)."""
    return called(types.float64(address, time, x, rate))


@intrinsic
def call_formula(_context, address, t, x, rate, program, answer):
    """Let the compiled code at an address run a program."""
    return called(types.void(address, t, x, rate, program, answer))


@inner
def given(forces, W, k, x, rate, wanted):
    """Law of the user, with derivatives if they are wanted; one in Python was asked before."""
    address, first = forces.address[k], forces.program_at[k]
    if address == 0:
        return forces.answer[k], forces.slope[k, 0], forces.slope[k, 1], 0.0, 0.0, 0.0
    t = W.signal[forces.clock[0], 0]
    if first < forces.program_at[k + 1]:
        call_formula(address, t, x, rate, forces.programs[first:], forces.formula)
        return forces.formula[0], forces.formula[1], forces.formula[2], 0.0, 0.0, 0.0
    by_x, by_rate = 0.0, 0.0
    if wanted:
        dx, dv = DIFFERENCE_STEP * (1.0 + abs(x)), DIFFERENCE_STEP * (1.0 + abs(rate))
        by_x = 0.5 * (call(address, t, x + dx, rate) - call(address, t, x - dx, rate)) / dx
        by_rate = 0.5 * (call(address, t, x, rate + dv) - call(address, t, x, rate - dv)) / dv
    return call(address, t, x, rate), by_x, by_rate, 0.0, 0.0, 0.0


@inner
def joint_load(s, forces, k, lam):
    """Resultant of the forces that the joint of force k transmits [N]."""
    total = 0.0
    first = forces.load_first[k]
    for row in range(first, first + forces.load_count[k]):
        if s.rows.kind[row] in (POINT, ALONG):
            total += lam[row] ** 2
    return math.sqrt(total)


@inner
def told(W, forces, k, load, wanted):
    """What the law of force k says, with derivatives of a user's if they are wanted."""
    law, x, rate = forces.law[k], W.x[forces.at[k]], W.xd[forces.at[k]]
    if forces.kind == LINEAR:
        return linear(law, x, rate)
    if forces.kind == STOP:
        return stop(law, x, rate)
    if forces.kind == FRICTION:
        return friction(law, load, rate)
    return given(forces, W, k, x, rate, wanted)


@residuals.of(JointForces)
def joint_wrenches(s, W, forces, _q, _v, lam):
    """Add the forces to the wrenches on the markers, and powers lost or that motors give."""
    for k in range(forces.at.size):
        at = forces.at[k]
        force, _, _, _, lost, _ = told(W, forces, k, joint_load(s, forces, k, lam), False)
        forces.answer[k] = force
        push_coordinate(s, W, at, force)
        W.power[2] += lost
        if forces.kind == MOTOR:
            W.driven[0] += force * W.xd[at]


@tangents.of(JointForces)
def joint_tangents(s, W, forces, lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(forces.at.size):
        force, by_x, by_rate, _, _, _ = told(W, forces, k, joint_load(s, forces, k, lam), True)
        if force != 0.0 or by_x != 0.0 or by_rate != 0.0:
            law = ck * force, ck * by_x, cc * by_rate
            coordinate_tangent(s, W, forces.at[k], law, W.Kt, W.S)


@energy.of(JointForces)
def joint_energy(_s, W, forces, _q, _v):
    """Energy stored by the forces."""
    total = 0.0
    for k in range(forces.at.size):
        total += told(W, forces, k, 0.0, False)[5]
    return total


@multiplier_columns.of(JointForces)
def load_columns(s, W, forces, lam, rank):
    """Add to W.UG what forces change with the multipliers of their joint."""
    for k in range(forces.at.size):
        load = joint_load(s, forces, k, lam)
        by_load = told(W, forces, k, load, False)[3]
        if by_load == 0.0 or load == 0.0:
            continue
        first = forces.load_first[k]
        for row in range(first, first + forces.load_count[k]):
            if s.rows.kind[row] not in (POINT, ALONG):
                continue
            change = -by_load * lam[row] / load
            for r in range(rank):
                u = W.U_lu[r, row] if rank < lam.size else (1.0 if r == row else 0.0)
                if u != 0.0:
                    add_gradient(s, W, forces.at[k], change * u, r)


@inner
def add_gradient(s, W, at, c, row):
    """Add c times the gradient of joint coordinate ``at`` in the velocities to a row of W.UG."""
    bodies, C = s.bodies, s.coordinates
    for side in range(2):
        m = C.i[at] if side == 0 else C.j[at]
        b = s.markers.body[m]
        first = column_of(s.graph, row, b) if s.graph.compact else bodies.v_at[b]
        for q in range(6 + bodies.r[b] if b >= 0 else 0):
            for p in range(6):
                W.UG[row, first + q] += c * W.xg[at, 6 * side + p] * W.H[m, p, q]


def joint_family(
    name: str, record: type, kind: int, made: type[JointForces] = JointForces, **more: object
) -> Family:
    """The family of a kind of forces, see `pack`; ``more`` is as of all families."""
    given = partial(pack, made, kind), joint_wrenches, joint_tangents
    return Family(name, record, *given, ends=on_joint, couples=apart, **more)
