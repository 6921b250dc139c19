"""Force laws written in Python."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Work
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.foreign import ask, numbers
from rom.model import Array

PAIR_TEXT = "two vectors of three numbers: force and moment"


@dataclass(frozen=True, slots=True)
class MarkerMotion:
    """How a marker moves.

    Attributes:
        position: (3,) world [m].
        axes: (3, 3) orientation of the marker, to world.
        velocity: (3,) world [m/s].
        omega: (3,) angular velocity, world [rad/s].
    """

    position: Array
    axes: Array
    velocity: Array
    omega: Array


@dataclass(frozen=True, slots=True)
class Law:
    """A user force with the rows of its markers; j is -1 without a second one."""

    name: str
    function: Any
    i: int
    j: int

    def apply(self, W: Work, t: float) -> None:
        """Add force and reaction to the wrenches of the user."""
        a = motion_of(W, self.i)
        others = () if self.j < 0 else (motion_of(W, self.j),)
        what = f"user force {self.name!r}"
        answer = ask(what, t, self.function, t, a, *others)
        force, moment = numbers(what, t, answer, (2, 3), PAIR_TEXT)
        W.user[self.i, :3] += force
        W.user[self.i, 3:] += moment
        for other in others:
            lever = a.position - other.position
            W.user[self.j, :3] -= force
            W.user[self.j, 3:] -= moment + np.cross(lever, force)


@dataclass(frozen=True, slots=True)
class MotorLaw:
    """A motor whose law stays in Python: its number, and that of its joint coordinate."""

    name: str
    function: Any
    k: int
    at: int

    def apply(self, W: Work, t: float) -> None:
        """Set the force of the motor."""
        what = f"the law of motor {self.name!r}"
        answer = ask(what, t, self.function, t, float(W.x[self.at]), float(W.xd[self.at]))
        W.motor[self.k] = numbers(what, t, answer, (), "a number")


Laws = tuple[Law | MotorLaw, ...]


def laws(mechanism: Mechanism, packed: Packed) -> Laws:
    """The user forces of a mechanism, and its motors that could not be compiled."""
    forces = [
        Law(name, u.function, packed.row(u.i), -1 if u.j is None else packed.row(u.j))
        for name, u in mechanism.user_forces.items()
    ]
    motor_at = packed.system.actions.motor_at
    motors = [
        MotorLaw(name, motor.law, k, int(motor_at[k]))
        for k, (name, motor) in enumerate(mechanism.motors.items())
        if motor.address == 0
    ]
    return (*forces, *motors)


def motion_of(W: Work, m: int) -> MarkerMotion:
    """Motion of marker m at the state of the last evaluation."""
    return MarkerMotion(W.P[m].copy(), W.E[m].copy(), W.V[m, :3].copy(), W.V[m, 3:].copy())


def apply_laws(forces: Laws, W: Work, t: float) -> None:
    """Call all laws and set the wrenches of the user.

    Raises:
        RomError: naming time and force if it fails, or a value is not finite.
    """
    W.user[:] = 0.0
    for law in forces:
        law.apply(W, t)
