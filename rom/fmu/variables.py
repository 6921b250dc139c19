"""Inputs in place of the functions of time of loads, motors and drives; outputs.

Outputs are the motion of markers, joint coordinates, and loads of drives.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from rom.io.fmu.description import Variable, components, structured
from rom.mbs.connections.drives import Drive
from rom.mbs.elements.joint_laws import FRICTIONS_FAMILY
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Work
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.signals import Signal, drive_signal
from rom.model import Array
from rom.names import check_known, check_once
from rom.rotation import quaternion

INFINITE_SPAN = (-np.inf, np.inf)
DIFFERENCE_SPACING = 1e-4  # of the differences for the speed of a drive at the start [s]
# reads (W, lam, packed) at an instant
Reading = Callable[[Work, Array, Packed], npt.ArrayLike]
Times = TypeVar("Times", float, Array)
Kept = tuple[Array, list[tuple[float, float, float]]]  # what inputs remember
MARKER_OUTPUTS = (
    ("position", 3, "m", "world"),
    ("velocity", 3, "m/s", "world"),
    ("quaternion", 4, "1", "marker to world, scalar first"),
    ("angular_velocity", 3, "rad/s", "world"),
)


@dataclass
class Held:
    """A drive by a held acceleration: coordinate and rate stay continuous."""

    acceleration: Array  # view (1,) of the input [rad/s^2 or m/s^2]
    t: float = 0.0  # since when it holds [s]
    x: float = 0.0  # coordinate then
    rate: float = 0.0  # and rate

    def coordinate(self, t: Times) -> Times:
        """Joint coordinate at a time."""
        s = t - self.t
        return self.x + s * (self.rate + s * self.acceleration[0] / 2)

    def speed(self, t: Times) -> Times:
        """Its rate."""
        return self.rate + (t - self.t) * self.acceleration[0]

    def second(self, t: Times) -> Times:
        """Its acceleration."""
        return self.acceleration[0] + 0.0 * t

    def follow(self, t: float) -> None:
        """Let the next acceleration hold from this time on."""
        self.x, self.rate, self.t = float(self.coordinate(t)), float(self.speed(t)), t


class Inputs:
    """The inputs of a mechanism, whose functions of time they replace, by name."""

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]):
        self.starts: list[tuple[Held, Callable[[float], tuple[float, float]]]] = []
        kinds = dict.fromkeys(mechanism.loads, _load)
        kinds |= dict.fromkeys(mechanism.spread_loads, _spread)
        kinds |= dict.fromkeys(mechanism.motors, _motor) | dict.fromkeys(mechanism.drives, _drive)
        check_once(names, "the input")
        for name in names:
            check_known(name, kinds, f"no input {name!r}; the loads, motors and drives are")
        found = {name: kinds[name](mechanism, name) for name in names}
        self.variables = [variable for several in found.values() for variable in several]
        self.values = np.array([v.start for v in self.variables], dtype=float)
        ends = np.cumsum([len(several) for several in found.values()])
        for name, values in zip(found, np.split(self.values, ends), strict=False):
            self._connect(mechanism, name, values)

    def _connect(self, mechanism: Mechanism, name: str, values: Array) -> None:
        """Let what has this name read the values."""
        if name in mechanism.loads:
            load = mechanism.loads[name]
            mechanism.loads[name] = replace(load, function=lambda t: values, vector=np.zeros(3))
        elif name in mechanism.spread_loads:
            spread = replace(mechanism.spread_loads[name], function=lambda t: values[0])
            mechanism.spread_loads[name] = replace(spread, amplitude=0.0)
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

    def kept(self) -> Kept:
        """What the inputs remember, to come back to."""
        return self.values.copy(), [(held.t, held.x, held.rate) for held, _ in self.starts]

    def recall(self, kept: Kept) -> None:
        """Come back to what was kept."""
        self.values[:], pasts = kept
        for (held, _), past in zip(self.starts, pasts, strict=True):
            held.t, held.x, held.rate = past


def _at(signal: Signal, t: float) -> Array:
    return signal.sample(np.array([t]), INFINITE_SPAN, DIFFERENCE_SPACING)[0]


def _load(mechanism: Mechanism, name: str) -> list[Variable]:
    load = mechanism.loads[name]
    value = np.asarray(load.function(0.0) if load.function else load.vector, dtype=float)
    what, unit = ("force", "N") if load.kind < 2 else ("torque", "N.m")
    frame = "world" if load.kind % 2 == 0 else "marker"
    about = f"{what}, axes of the {frame}"
    return components(structured(name), "input", unit, value, about)


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


def output_names(mechanism: Mechanism) -> list[str]:
    """All outputs there can be: markers with names, joints with a coordinate, drives."""
    joints = [name for name, joint in mechanism.joints.items() if joint.coordinate is not None]
    return [*_places(mechanism), *joints, *mechanism.drives]


def _places(mechanism: Mechanism) -> dict[str, Marker]:
    """All markers with names, as "body.marker"."""
    parts = mechanism.parts.values()
    return {f"{part.name}.{place}": part.marker(place) for part in parts for place in part.names}


class Outputs:
    """What an FMU tells of its mechanism: of the names of `output_names` that are given.

    Joints among them get a friction of zero, by which the integrator counts their whole turns.
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]):
        self.variables: list[Variable] = []
        self.readings: list[Reading] = []
        places, known = _places(mechanism), output_names(mechanism)
        check_once(names, "the output")
        for name in names:
            check_known(name, known, f"no output {name!r}; there are")
            if name in places:
                self._marker(places[name])
            elif name in mechanism.joints:
                self._joint(mechanism, name)
            else:
                self._drive(mechanism, name)

    def values(self, W: Work, lam: Array, packed: Packed) -> Array:
        """(n,) all outputs after an evaluation of the mechanism."""
        found = [np.ravel(read(W, lam, packed)) for read in self.readings]
        return np.concatenate(found) if found else np.zeros(0)

    def _marker(self, marker: Marker) -> None:
        for what, count, unit, axes in MARKER_OUTPUTS:
            name = structured(marker.body, str(marker.place), what)
            self.variables += components(name, "output", unit, [None] * count, axes)
        self.readings += [
            lambda W, lam, packed: W.P[packed.row(marker)],
            lambda W, lam, packed: W.V[packed.row(marker), :3],
            lambda W, lam, packed: quaternion(W.E[packed.row(marker)]),
            lambda W, lam, packed: W.V[packed.row(marker), 3:],
        ]

    def _joint(self, mechanism: Mechanism, name: str) -> None:
        joint = mechanism.joints[name]
        ways: Any = (("angle", joint.turn, "rad"), ("way", joint.displacement, "m"))
        for what, row, unit in ways:
            if row is None:
                continue
            k = len(mechanism.frictions)
            mechanism.friction(f"{what} of {name}", name, transition_speed=1.0, coordinate=what)
            self.variables += [
                Variable(structured(name, what), "output", unit, description="from the start"),
                Variable(structured(name, f"{what}_rate"), "output", f"{unit}/s"),
            ]
            self.readings += [_coordinate("x", k), _coordinate("xd", k)]

    def _drive(self, mechanism: Mechanism, name: str) -> None:
        joint = mechanism.joints[mechanism.drives[name].joint]
        unit = "N.m" if joint.coordinate is joint.turn else "N"
        about = "that the drive supplies along its joint coordinate"
        self.variables.append(Variable(structured(name, "load"), "output", unit, None, about))
        self.readings.append(lambda W, lam, packed: -lam[packed.rows_of(name)[0]])


def _coordinate(what: str, k: int) -> Reading:
    """Coordinate or rate that friction k follows."""
    return lambda W, lam, packed: getattr(W, what)[packed.elements[FRICTIONS_FAMILY].at[k]]
