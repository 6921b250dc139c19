"""Motors: forces along joint coordinates from a law of control."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic

from rom.mbs.compiler.calls import called
from rom.mbs.elements.family import Family, Places, apart, integers, on_joint, starts
from rom.mbs.elements.formulas.programs import Formula
from rom.mbs.elements.law_calls import DIFFERENCE_STEP
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.element_calls import residuals, tangents
from rom.mbs.kernels.tables import Address1, Array1, Index1, Scratch1, Scratch2, Table, table
from rom.mbs.parts.foreign import ask, compiled_function, numbers
from rom.mbs.parts.joints import Coordinate, Row, coordinate_of
from rom.mbs.parts.whole import Whole
from rom.model import Array


@dataclass(frozen=True, slots=True)
class Motor:
    """Force along a joint coordinate from a law (t, coordinate, rate)."""

    joint: str
    row: Row
    law: Callable[[float, float, float], float]
    compiled: Any

    @property
    def address(self) -> int:
        """Of the compiled law; 0 when it is left to Python."""
        return self.compiled.address if self.compiled is not None else 0

    @property
    def program(self) -> Array:
        """(n,) length and program of a formula; none of other laws."""
        if not isinstance(self.law, Formula):
            return np.zeros(0)
        return np.concatenate([[1.0 + self.law.program.size], self.law.program])


def motor(
    self: Whole,
    name: str,
    joint: str,
    law: Callable[[float, float, float], float],
    *,
    coordinate: Coordinate | None = None,
    compiled: bool | None = None,
) -> None:
    """Motor with a control law: force [N] or torque [N m] = ``law(t, coordinate, rate)``.

    It acts along the joint coordinate on the second body and back on the first. The law is
    compiled by Numba when it can be; a compiled law sees outer variables as they were when
    the motor was added. What cannot be compiled runs as plain Python, some ten times slower.

    Args:
        name: name of the motor.
        joint: joint with a coordinate.
        law: function of time [s], coordinate [rad or m] and its rate, or one of Numba, or a
            `rom.mbs.elements.formulas.programs.Formula`.
        coordinate: "angle" or "displacement"; None for the only or the first one.
        compiled: True to insist, False to leave it to Python, None for what works.

    Raises:
        ConfigError: if the joint has no such coordinate, or the law is no function of three
            numbers, or cannot be compiled although it must.
    """
    row = coordinate_of(self.joints, joint, coordinate, "motor")
    self.add(name, Motor(joint, row, law, _compiled(name, law, compiled)), MOTORS_FAMILY)


def _compiled(name: str, law: Any, wanted: bool | None) -> Any:
    """The law as a C function of three doubles, None when it is left to Python."""
    if isinstance(law, Formula):
        return law
    make = numba.cfunc("float64(float64, float64, float64)")
    hint = "Use numbers and NumPy functions of numbers only, or compiled=False."
    return compiled_function(f"law of motor {name!r}", law, make, wanted, hint)


@table
class Motors(Table):
    """All motors.

    Attributes:
        at: (k,) joint coordinates.
        address: (k,) of compiled laws, 0 for Python.
        program_at: (k + 1,) where the programs of formulas begin; equal numbers for other laws.
        programs: (p,) of all formulas.
        clock: (1,) function that tells the time.
        formula: (3,) what the formula at hand gives: force, and its derivatives.
        answer: (k,) forces at the last residual; those of laws in Python before it.
        slope: (k, 2) derivatives of laws in Python by coordinate and rate.
    """

    at: Index1
    address: Address1
    program_at: Index1
    programs: Array1
    clock: Index1
    formula: Scratch1
    answer: Scratch1
    slope: Scratch2


def pack(motors: Any, places: Places) -> Motors:
    """The motors as arrays."""
    found = motors.values()
    programs = [motor.program for motor in found]
    return Motors(
        integers(places.coordinate(m.joint, m.row) for m in found),
        integers(m.address for m in found),
        starts([program.size for program in programs]),
        np.concatenate(programs),
        integers([places.clock()]),
        np.zeros(3),
        np.zeros(len(found)),
        np.zeros((len(found), 2)),
    )


@dataclass(frozen=True, slots=True)
class MotorLaw:
    """A motor whose law stays in Python: its number."""

    name: str
    law: Any
    k: int
    motors: Motors

    def apply(self, W: Any, t: float, *, slopes: bool) -> None:
        """Set the force of the motor, and its slopes."""
        at, motors, what = self.motors.at[self.k], self.motors, f"the law of motor {self.name!r}"
        x, rate = float(W.x[at]), float(W.xd[at])

        def force(x: float, rate: float) -> Any:
            return numbers(what, t, ask(what, t, self.law, t, x, rate), (), "a number")

        motors.answer[self.k] = force(x, rate)
        if slopes:
            dx, dv = DIFFERENCE_STEP * (1.0 + abs(x)), DIFFERENCE_STEP * (1.0 + abs(rate))
            by_x = (force(x + dx, rate) - force(x - dx, rate)) / dx
            motors.slope[self.k] = by_x / 2, (force(x, rate + dv) - force(x, rate - dv)) / dv / 2


def asked(motors: Mapping[str, Motor], packed: Motors, _followed: int) -> Sequence[MotorLaw]:
    """The motors that could not be compiled."""
    return [
        MotorLaw(name, motor.law, k, packed)
        for k, (name, motor) in enumerate(motors.items())
        if motor.address == 0
    ]


@intrinsic
def call(_context, address, time, x, rate):
    """Value of the compiled law at an address: double (double, double, double)."""
    return called(types.float64(address, time, x, rate))


@intrinsic
def call_formula(_context, address, t, x, rate, program, answer):
    """Let the compiled code at an address run a program."""
    return called(types.void(address, t, x, rate, program, answer))


@inner
def ask_formula(motors, W, k, x, rate):
    """Whether motor k has a formula; if so, set motors.formula."""
    first = motors.program_at[k]
    if first == motors.program_at[k + 1]:
        return False
    program, t = motors.programs[first:], W.signal[motors.clock[0], 0]
    call_formula(motors.address[k], t, x, rate, program, motors.formula)
    return True


@inner
def motor_force(motors, W, k, x, rate):
    """Force of motor k at a coordinate and its rate; a Python law was asked before."""
    if motors.address[k] == 0:
        return motors.answer[k]
    if ask_formula(motors, W, k, x, rate):
        return motors.formula[0]
    return call(motors.address[k], W.signal[motors.clock[0], 0], x, rate)


@inner
def motor_slopes(motors, W, k, x, rate):
    """Derivatives of a motor law by coordinate and rate; of a formula, or central differences."""
    if motors.address[k] == 0:
        return motors.slope[k, 0], motors.slope[k, 1]
    if ask_formula(motors, W, k, x, rate):
        return motors.formula[1], motors.formula[2]
    dx, dv = DIFFERENCE_STEP * (1.0 + abs(x)), DIFFERENCE_STEP * (1.0 + abs(rate))
    by_x = motor_force(motors, W, k, x + dx, rate) - motor_force(motors, W, k, x - dx, rate)
    by_rate = motor_force(motors, W, k, x, rate + dv) - motor_force(motors, W, k, x, rate - dv)
    return 0.5 * by_x / dx, 0.5 * by_rate / dv


@residuals.of(Motors)
def motor_wrenches(s, W, motors, _q, _v, _lam):
    """Add the motors to the wrenches on the markers, and their power to W.driven."""
    for k in range(motors.at.size):
        at = motors.at[k]
        force = motor_force(motors, W, k, W.x[at], W.xd[at])
        motors.answer[k] = force
        push_coordinate(s, W, at, force)
        W.driven[0] += force * W.xd[at]


@tangents.of(Motors)
def motor_tangents(s, W, motors, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(motors.at.size):
        at = motors.at[k]
        x, rate = W.x[at], W.xd[at]
        by_x, by_rate = motor_slopes(motors, W, k, x, rate)
        law = ck * motor_force(motors, W, k, x, rate), ck * by_x, cc * by_rate
        coordinate_tangent(s, W, at, law, W.Kt, W.S)


MOTORS_FAMILY = Family(
    "motors", Motor, pack, motor_wrenches, motor_tangents, ends=on_joint, couples=apart,
    asked=asked, answers=lambda motors: motors.answer,
)  # fmt: skip
