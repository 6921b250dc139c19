"""Inputs in place of the functions of time of loads, motors and drives."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.io.fmu.variables import Variable, structured
from rom.mbs.connections.drives import Drive
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.signals import drive_signal
from rom.model import Array
from rom.names import check_known, check_once

INFINITE_SPAN = (-np.inf, np.inf)
DIFFERENCE_SPACING = 1e-4  # of the differences for the speed of a drive at the start [s]


@dataclass
class Held:
    """A drive by a held acceleration: coordinate and rate stay continuous.

    Attributes:
        acceleration: view (1,) of the input [rad/s^2 or m/s^2].
        t: time since when it holds [s].
        x, rate: coordinate and rate then.
    """

    acceleration: Array
    t: float = 0.0
    x: float = 0.0
    rate: float = 0.0

    def coordinate(self, t: Any) -> Any:
        """Joint coordinate at a time."""
        s = t - self.t
        return self.x + s * (self.rate + s * self.acceleration[0] / 2)

    def speed(self, t: Any) -> Any:
        """Its rate."""
        return self.rate + (t - self.t) * self.acceleration[0]

    def second(self, t: Any) -> Any:
        """Its acceleration."""
        return self.acceleration[0] + 0.0 * t

    def follow(self, t: float) -> None:
        """Let the next acceleration hold from this time on."""
        self.x, self.rate, self.t = float(self.coordinate(t)), float(self.speed(t)), t


class Inputs:
    """The inputs of a mechanism, whose functions of time they replace.

    Args:
        mechanism: it is changed.
        names: of loads, spread loads, motors or drives.

    Raises:
        ConfigError: for a name that has no input, or twice the same.
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]):
        self.starts: list[tuple[Held, Callable[[float], tuple[float, float]]]] = []
        kinds = {
            **dict.fromkeys(mechanism.loads, _load),
            **dict.fromkeys(mechanism.spread_loads, _spread),
            **dict.fromkeys(mechanism.motors, _motor),
            **dict.fromkeys(mechanism.drives, _drive),
        }
        check_once(names, "the input")
        for name in names:
            check_known(name, kinds, f"no input {name!r}; the loads, motors and drives are")
        found = {name: kinds[name](mechanism, name) for name in names}
        self.variables = [variable for several in found.values() for variable in several]
        self.values = np.array([v.start for v in self.variables], dtype=float)
        first = 0
        for name, several in found.items():
            self._connect(mechanism, name, self.values[first : first + len(several)])
            first += len(several)

    def _connect(self, mechanism: Mechanism, name: str, values: Array) -> None:
        """Let what has this name read the values."""
        if name in mechanism.loads:
            load = mechanism.loads[name]
            mechanism.loads[name] = replace(load, function=lambda t: values, vector=np.zeros(3))
        elif name in mechanism.spread_loads:
            spread = mechanism.spread_loads[name]
            mechanism.spread_loads[name] = replace(
                spread, function=lambda t: values[0], amplitude=0.0
            )
        elif name in mechanism.motors:  # compiled, it would keep the value of now
            motor = mechanism.motors[name]
            mechanism.motors[name] = replace(motor, law=lambda t, x, xd: values[0], compiled=None)
        else:
            drive, held = mechanism.drives[name], Held(values)
            signal = drive_signal(name, drive)
            self.starts.append((held, lambda t: tuple(_at(signal, t)[:2])))
            mechanism.drives[name] = Drive(drive.joint, held.coordinate, held.speed, held.second)

    def begin(self, t: float) -> None:
        """Let all drives start where their own functions of time are, and as fast."""
        for held, start in self.starts:
            held.t = t
            held.x, held.rate = start(t)

    def follow(self, t: float) -> None:
        """Let the inputs given from now on hold from this time on."""
        for held, _ in self.starts:
            held.follow(t)

    def kept(self) -> list[Any]:
        """What the inputs remember, to come back to."""
        return [self.values.copy(), *((held.t, held.x, held.rate) for held, _ in self.starts)]

    def recall(self, kept: list[Any]) -> None:
        """Come back to what was kept."""
        self.values[:] = kept[0]
        for (held, _), past in zip(self.starts, kept[1:], strict=True):
            held.t, held.x, held.rate = past


def _at(signal: Any, t: float) -> Array:
    return signal.sample(np.array([t]), INFINITE_SPAN, DIFFERENCE_SPACING)[0]


def _load(mechanism: Mechanism, name: str) -> list[Variable]:
    load = mechanism.loads[name]
    value = np.asarray(load.function(0.0) if load.function else load.vector, dtype=float)
    what, unit = ("force", "N") if load.kind < 2 else ("torque", "N.m")
    frame = "world" if load.kind % 2 == 0 else "marker"
    return [
        Variable(
            f"{structured(name)}[{k}]", "input", unit, float(x), f"{what}, axes of the {frame}"
        )
        for k, x in enumerate(value, 1)
    ]


def _spread(mechanism: Mechanism, name: str) -> list[Variable]:
    load = mechanism.spread_loads[name]
    start = float(load.function(0.0) if load.function else load.amplitude)
    return [Variable(structured(name), "input", "1", start, "amplitude of the spread load")]


def _motor(mechanism: Mechanism, name: str) -> list[Variable]:
    motor = mechanism.motors[name]
    turns = motor.row is mechanism.joints[motor.joint].turn
    what, unit = ("torque", "N.m") if turns else ("force", "N")
    about = f"{what} along the coordinate of {motor.joint}"
    return [Variable(structured(name), "input", unit, 0.0, about)]


def _drive(mechanism: Mechanism, name: str) -> list[Variable]:
    drive = mechanism.drives[name]
    joint = mechanism.joints[drive.joint]
    unit = "rad/s2" if joint.coordinate is joint.turn else "m/s2"
    start = float(_at(drive_signal(name, drive), 0.0)[2])
    about = f"acceleration of the coordinate of {drive.joint}"
    return [Variable(structured(name, "acceleration"), "input", unit, start, about)]
