"""Motors: forces along joint coordinates from a law of control."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np

from rom.mbs.elements.family import Hold, Hooks
from rom.mbs.elements.formulas.programs import Formula
from rom.mbs.elements.joint_forces import MOTOR, NO_PROGRAM, Motors, joint_family
from rom.mbs.elements.law_calls import DIFFERENCE_STEP
from rom.mbs.kernels.work import Work
from rom.mbs.parts.foreign import Entry, Function, ask, compiled_function, in_python, numbers
from rom.mbs.parts.joints import Coordinate, Row, Whole, coordinate_of
from rom.model import Array


@dataclass(frozen=True, slots=True)
class Motor:
    """Force along a joint coordinate from a law (t, coordinate, rate)."""

    joint: str
    row: Row
    law: Callable[[float, float, float], float] | None  # None if its force is set from outside
    compiled: Entry | None
    every: float | None = None  # from one sample to the next [s]
    laws: ClassVar[tuple[tuple[float, ...], ...]] = ((),)  # one, without numbers

    @property
    def address(self) -> int:
        """Of the compiled law; 0 when it is left to Python."""
        return self.compiled.address if self.compiled is not None else 0

    @property
    def program(self) -> Array:
        """(n,) length and program of a formula; none of other laws."""
        if self.compiled is None or not isinstance(self.law, Formula):
            return NO_PROGRAM
        return np.concatenate([[1.0 + self.law.program.size], self.law.program])


def motor(
    self: Whole,
    name: str,
    joint: str,
    law: Callable[[float, float, float], float],
    *,
    coordinate: Coordinate | None = None,
    compiled: bool | None = None,
    every: Hold = None,
) -> None:
    """Motor with a control law: force [N] or torque [N m] = ``law(t, coordinate, rate)``.

    It acts along the joint coordinate on the second body and back on the first. The law is
    compiled by Numba when it can be; a compiled law sees outer variables as they were when
    the motor was added. What cannot be compiled runs as plain Python, some ten times slower.

    Args:
        joint: joint with a coordinate.
        law: function of time [s], coordinate [rad or m] and its rate, or one of Numba, or a
            `rom.mbs.elements.formulas.programs.Formula`.
        coordinate: "angle" or "displacement"; None for the only or the first one.
        compiled: True to insist, False to leave it to Python, None for what works.
        every: time between two samples [s], if the law, of Python, is called once for each, from
            the start of a motion on, and its value held. It may be an object that remembers.

    Raises:
        ConfigError: if the joint has no such coordinate, or the law is no function of three
            numbers, or cannot be compiled although it must.
    """
    row = coordinate_of(self.joints, joint, coordinate, "motor")
    entry = _compiled(name, law, in_python(f"law of motor {name!r}", law, every, compiled))
    self.add(name, Motor(joint, row, law, entry, every), MOTORS_FAMILY)


def _compiled(name: str, law: Function, wanted: bool | None) -> Entry | None:
    """The law as a C function of three doubles, None when it is left to Python."""
    if isinstance(law, Formula) and wanted is not False:
        return law
    make = numba.cfunc("float64(float64, float64, float64)")
    hint = "Use numbers and NumPy functions of numbers only, or compiled=False."
    return compiled_function(f"law of motor {name!r}", law, make, wanted, hint)


@dataclass(frozen=True, slots=True)
class MotorLaw:
    """A motor whose law stays in Python: its number."""

    name: str
    law: Function
    k: int
    motors: Motors

    @property
    def answer(self) -> Array:
        """Its force."""
        return self.motors.answer[self.k : self.k + 1]

    def apply(self, W: Work, t: float, *, slopes: bool) -> None:
        """Set the force of the motor, and its slopes."""
        at, motors, what = self.motors.at[self.k], self.motors, f"the law of motor {self.name!r}"
        x, rate = float(W.x[at]), float(W.xd[at])

        def force(x: float, rate: float) -> Array:
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
        if motor.address == 0 and motor.law
    ]


HOOKS = Hooks(asked=asked, answers=lambda motors: motors.answer)
MOTORS_FAMILY = joint_family("motors", Motor, MOTOR, Motors, hooks=HOOKS)
