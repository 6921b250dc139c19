"""Inputs in place of loads, motors, drives and parameters of laws, and outputs, by name."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby, repeat
from typing import Any, NamedTuple, TypeVar

import numpy as np

from rom.io.fmu.description import Variable, components, structured
from rom.io.history import AXIS_LETTERS, QUATERNION_PARTS
from rom.mbs.connections.drives import Drive
from rom.mbs.elements.laws import LAWS_FAMILY
from rom.mbs.elements.loads import LOADS_FAMILY
from rom.mbs.elements.motors import MOTORS_FAMILY
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Step, Work
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.joints import Joint, Row, Whole
from rom.mbs.parts.signals import CLOCK, Signal, drive_signal
from rom.mbs.results.recomputed import stress_in_motion
from rom.model import OWN_FRAME, Array
from rom.names import check_known, check_once
from rom.rotation import quaternion

INFINITE_SPAN = (-np.inf, np.inf)
DIFFERENCE_SPACING = 1e-4  # of the differences for the speed of a drive at the start [s]
STRESS_PARTS = ("xx", "yy", "zz", "yz", "xz", "xy")
UNITS = {
    **{"position": "m", "velocity": "m/s", "orientation": "1", "omega": "rad/s", "elastic": "1"},
    "stress": "Pa",
}
Times = TypeVar("Times", float, Array)
Reading = tuple[str, tuple[str, ...], int]  # what is asked, of what, which number of the answer
Told = Array | tuple[Array, Array]  # some numbers
Past = tuple[float, float, float]  # since when an acceleration holds, coordinate and rate then
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
    """The inputs of a mechanism, whose functions of time they replace, by name.

    Attributes:
        variables: all of them, in order.
        values: (n,) what they are now; views of it go into the mechanism, which is changed.
        start: (n,) what the mechanism had.
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]):
        self.drives: dict[str, tuple[Held, Signal]] = {}
        kinds = dict.fromkeys(mechanism.loads, _load)
        kinds |= dict.fromkeys(mechanism.spread_loads, _spread)
        kinds |= dict.fromkeys(mechanism.motors, _motor) | dict.fromkeys(mechanism.drives, _drive)
        kinds |= {name: _law for name, law in mechanism.laws.items() if law.parameters.size}
        check_once(names, "the input")
        for name in names:
            check_known(name, kinds, f"no input {name!r}; the loads, motors and drives are")
        found = {name: kinds[name](mechanism, name) for name in names}
        self.variables = [variable for several in found.values() for variable in several]
        self.start = np.array([v.start for v in self.variables], dtype=float)
        self.values = self.start.copy()
        ends = np.cumsum([len(several) for several in found.values()])
        self.own = dict(zip(found, np.split(self.values, ends), strict=False))
        for name, values in self.own.items():
            self._connect(mechanism, name, values)

    def _connect(self, mechanism: Mechanism, name: str, values: Array) -> None:
        """Let what has this name read the values."""
        if name in mechanism.loads:
            load = mechanism.loads[name]
            mechanism.loads[name] = replace(load, function=lambda t: values, vector=np.zeros(3))
        elif name in mechanism.spread_loads:
            spread = replace(mechanism.spread_loads[name], function=lambda t: values[0])
            mechanism.spread_loads[name] = replace(spread, amplitude=0.0)
        elif name in mechanism.motors:
            motor = mechanism.motors[name]
            mechanism.motors[name] = replace(motor, law=None, compiled=None, every=None)
        elif name in mechanism.laws:
            mechanism.laws[name] = replace(mechanism.laws[name], parameters=values)
        else:
            drive, held = mechanism.drives[name], Held(values)
            self.drives[name] = held, drive_signal(name, drive)
            mechanism.drives[name] = Drive(drive.joint, held.coordinate, held.speed, held.second)

    def bind(self, packed: Packed) -> None:
        """Find where the arrays of the mechanism hold what inputs set."""
        self.told: list[tuple[Array, Array]] = []
        for family in (MOTORS_FAMILY, LAWS_FAMILY):
            for k, name in enumerate(packed.element_names.get(family, ())):
                if name in self.own:
                    table, motor = packed.elements[family], family is MOTORS_FAMILY
                    at = slice(k, k + 1) if motor else slice(*table.parameter_at[k : k + 2])
                    place = table.answer if motor else table.parameters
                    self.told.append((place[at], self.own[name]))
        names = {k: signal.name for k, signal in enumerate(packed.signals) if signal is not CLOCK}
        self.signals = {k: self.own[x] for k, x in names.items() if x in self.own}
        self.others = [k for k in range(len(packed.signals)) if k not in self.signals]
        self.motions = {
            k: self.drives[names[k]][0] for k in self.signals if names[k] in self.drives
        }

    def tell(self) -> None:
        """Tell motors and laws their values."""
        for place, values in self.told:
            place[...] = values

    def write(self, t: Array, signals: Array) -> None:
        """Tell signals (n, s, 3) at times (n,) the values of loads and drives."""
        for k, values in self.signals.items():
            signals[:, k, : values.size] = values
        for k, held in self.motions.items():
            signals[:, k, 0], signals[:, k, 1] = held.coordinate(t), held.speed(t)
            signals[:, k, 2] = held.acceleration[0]

    def begin(self, t: float) -> None:
        """Let all drives start where their own functions of time are, and as fast."""
        for held, signal in self.drives.values():
            held.t = t
            held.x, held.rate = _at(signal, t)[:2].tolist()

    def follow(self, t: float) -> None:
        """Let the inputs given from now on hold from this time on."""
        for held, _ in self.drives.values():
            held.follow(t)

    @property
    def past(self) -> list[Past]:
        """What drives remember, to come back to."""
        return [(held.t, held.x, held.rate) for held, _ in self.drives.values()]

    @past.setter
    def past(self, past: list[Past]) -> None:
        for (held, _), one in zip(self.drives.values(), past, strict=True):
            held.t, held.x, held.rate = one


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


def _law(mechanism: Mechanism, name: str) -> list[Variable]:
    about = "parameter of the law, in its own unit"
    return components(structured(name), "input", "1", mechanism.laws[name].parameters, about)


def targets(self: Whole) -> Iterator[tuple[str, tuple[str, int]]]:
    """Components of loads, and motors: in words, its element and the component of that."""
    for name, (family, _) in self.elements.items():
        if family is LOADS_FAMILY:
            yield from ((f"{name} {x}", (name, k)) for k, x in enumerate(AXIS_LETTERS))
        elif family is MOTORS_FAMILY:
            yield name, (name, 0)


def readings(self: Whole) -> Iterator[tuple[str, Reading]]:
    """What there is to tell, by the names of the columns of `rom.write_history`."""
    moving = {"position": AXIS_LETTERS, "velocity": AXIS_LETTERS}
    for body, part in self.parts.items():
        elastic = tuple(f"q{k + 1}" for k in range(part.r))
        own = {"orientation": QUATERNION_PARTS, "omega": AXIS_LETTERS, "elastic": elastic}
        for of in ((body,), *((body, marker) for marker in part.names)):
            for what, letters in (moving if len(of) > 1 else moving | own).items():
                yield from (
                    (" ".join((*of, what, x)), (what, of, k)) for k, x in enumerate(letters)
                )
    for name in (*self.joints, *self.drives):
        for k, x in enumerate(f"{what} {x}" for what in ("force", "moment") for x in AXIS_LETTERS):
            yield f"{name} {x}", ("reaction", (name,), k)
    for name, joint in self.joints.items():
        for what, _ in _coordinates(joint):
            for k, x in enumerate((what, f"{what} rate")):
                yield f"{name} {x}", ("joint", (name, what), k)


def _coordinates(joint: Joint) -> list[tuple[str, Row]]:
    """The coordinates that a joint leaves, by name."""
    rows = {"angle": joint.turn, "displacement": joint.displacement}
    return [(what, row) for what, row in rows.items() if row is not None]


def output_names(mechanism: Mechanism) -> list[str]:
    """All outputs that FMUs have unasked: markers with names, joints with a coordinate, drives."""
    joints = [name for name, joint in mechanism.joints.items() if joint.coordinate is not None]
    return [*_places(mechanism), *joints, *mechanism.drives]


def _places(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """All markers with names, as "body.marker"."""
    parts = mechanism.parts.values()
    return {f"{part.name}.{place}": (part.name, place) for part in parts for place in part.names}


class View(NamedTuple):
    """Where outputs are read: the mechanism evaluated in W at the instant of a step."""

    packed: Packed
    parts: dict[str, Part]
    W: Work
    step: Step


class Output(NamedTuple):
    """Some numbers: what is asked, of what, which of the answer, and what they are."""

    what: str
    of: tuple[str, ...]
    pick: slice
    variables: list[Variable]


class Outputs:
    """What is told of a mechanism.

    Of the names of `output_names`: of "body.marker" position, velocity, quaternion and angular
    velocity, of a joint its coordinates and their rates, of a drive the load it supplies; or of
    quantities as `rom.write_history` heads its columns, "arm.tip position", "hinge force x",
    "arm elastic"; or "arm stress 7", at a point of the surface of a body with stress recovery.
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]):
        self.asked: list[Output] = []
        self.followed: list[tuple[str, Row]] = []
        self.mechanism, places = mechanism, _places(mechanism)
        check_once(names, "the output")
        for name in names:
            if name in places:
                self._marker(*places[name])
            elif name in mechanism.joints and mechanism.joints[name].coordinate is not None:
                self._joint(name)
            elif name in mechanism.drives:
                self._drive(name)
            else:
                self._words(name)
        self.variables = [variable for one in self.asked for variable in one.variables]
        self.values = np.zeros(len(self.variables))

    def bind(self, view: View) -> None:
        """Find where the numbers stand: those that are copied, and those to be computed."""
        self.copied: list[tuple[Array, Any]] = []
        self.computed: list[tuple[Array, Callable[[], Any], slice]] = []
        at = 0
        for what, of, pick, variables in self.asked:
            own = self.values[at : at + len(variables)]
            at += own.size
            found = _told(view, what, of)
            if callable(found):
                self.computed.append((own, found, pick))
            elif isinstance(found, tuple):
                self.copied += [(own[k : k + 1], x) for k, x in enumerate(found[pick])]
            else:
                self.copied.append((own, found[pick]))

    def read(self) -> Array:
        """(n,) all outputs after an evaluation of the mechanism."""
        for own, found in self.copied:
            own[...] = found
        for own, compute, pick in self.computed:
            own[...] = compute()[pick]
        return self.values

    def _marker(self, body: str, marker: str) -> None:
        for what, count, unit, axes in MARKER_OUTPUTS:
            name = structured(body, marker, what)
            own = components(name, "output", unit, [None] * count, axes)
            self.asked.append(Output(what, (body, marker), slice(None), own))

    def _joint(self, name: str) -> None:
        for what, row in _coordinates(self.mechanism.joints[name]):
            self.followed.append((name, row))
            word, unit = ("angle", "rad") if what == "angle" else ("way", "m")
            own = [
                Variable(structured(name, word), "output", unit, description="from the start"),
                Variable(structured(name, f"{word}_rate"), "output", f"{unit}/s"),
            ]
            self.asked.append(Output("joint", (name, what), slice(None), own))

    def _drive(self, name: str) -> None:
        joint = self.mechanism.joints[self.mechanism.drives[name].joint]
        unit = "N.m" if joint.coordinate is joint.turn else "N"
        about = "that the drive supplies along its joint coordinate"
        own = [Variable(structured(name, "load"), "output", unit, None, about)]
        self.asked.append(Output("load", (name,), slice(None), own))

    def _words(self, name: str) -> None:
        """Columns of a history that begin with this, or components of a stress."""
        wanted, mechanism = name.replace(".", " "), self.mechanism
        known = {**dict(readings(mechanism)), **_stresses(mechanism, wanted)}
        found = [key for key in known if f"{key} ".startswith(f"{wanted} ")]
        if not found:
            able = known if " " in name else output_names(mechanism)
            check_known(name, able, f"no output {name!r}; there are")
        for (what, of), some in groupby(found, lambda key: known[key][:2]):
            keys = list(some)
            numbers = [known[key][2] for key in keys]
            pick = slice(numbers[0], numbers[-1] + 1)
            units = (_unit(what, of, k) for k in numbers)
            names = map(Variable, map(structured, keys), repeat("output"), units)
            self.asked.append(Output(what, of, pick, list(names)))
            if what == "joint":
                self.followed.append((of[0], dict(_coordinates(mechanism.joints[of[0]]))[of[1]]))


def _unit(what: str, of: tuple[str, ...], k: int) -> str:
    if what == "reaction":
        return "N" if k < 3 else "N.m"
    if what == "joint":
        return ("rad" if of[1] == "angle" else "m") + ("/s" if k else "")
    return UNITS[what]


def _stresses(mechanism: Mechanism, wanted: str) -> dict[str, Reading]:
    """Components of the stress [Pa] at the point of the surface that a name asks for."""
    body, _, words = wanted.partition(" stress ")
    point, part = words.partition(" ")[0], mechanism.parts.get(body)
    recovery: Any = getattr(part.moving, "stress", None) if part and part.r else None
    good = hasattr(recovery, "at") and point.isdecimal()  # of a linear body
    if not good or int(point) >= len(recovery.points):
        return {}
    of = "stress", (body, point)
    return {f"{body} stress {point} {x}": (*of, k) for k, x in enumerate(STRESS_PARTS)}


def _of_body(view: View, what: str, body: str, place: str = "") -> Told | Callable[[], Told]:
    """What a marker, or the frame of a body, tells: a view, or what computes it."""
    packed, W, step = view.packed, view.W, view.step
    b, bodies = packed.names.index(body), packed.system.bodies
    q, v = step.q[bodies.q_at[b] :], step.v[bodies.v_at[b] :]
    if what == "elastic":
        return q[7 : 7 + bodies.r[b]]
    row = packed.markers.get(Marker(body, place or OWN_FRAME))
    if row is None:  # it moves in the frame that it was given
        return {"position": q[:3], "orientation": q[3:7], "velocity": v[:3], "omega": v[3:6]}[what]
    P, E, V = W.P[row], W.E[row], W.V[row]
    told: dict[str, Told | Callable[[], Told]] = {
        **{"position": P, "velocity": V[:3], "angular_velocity": V[3:]},
        **dict.fromkeys(("quaternion", "orientation"), lambda: quaternion(E)),
        "omega": lambda: V[3:] @ E,
    }
    return told[what]


def _stress(view: View, body: str, point: str) -> Callable[[], Told]:
    """Components of the stress at a point of the surface."""
    b, bodies = view.packed.names.index(body), view.packed.system.bodies
    step, q_at, v_at, r = view.step, bodies.q_at[b], bodies.v_at[b], bodies.r[b]
    recovery = view.parts[body].moving.stress.at(int(point))
    q, v, a = step.q[q_at + 7 :][:r], step.v[v_at:], step.vd[v_at:][: 6 + r]
    here = recovery, q, view.W.A[b], v[3:6], a, bodies.gravity
    return lambda: stress_in_motion(*here).ravel()


def _told(view: View, what: str, of: tuple[str, ...]) -> Told | Callable[[], Told]:
    """Where some numbers stand, or what computes them."""
    packed, W = view.packed, view.W
    if what == "stress":
        return _stress(view, *of)
    if what == "joint":
        k = packed.places.coordinate(of[0], dict(_coordinates(packed.places.joints[of[0]]))[of[1]])
        return W.x[k : k + 1], W.xd[k : k + 1]
    if what not in ("reaction", "load"):
        return _of_body(view, what, *of)
    rows = packed.rows_of(*of)  # which stand behind each other
    lam, gradient = view.step.lam[rows[0] :][: rows.size], W.g[rows[0] :, 6:12][: rows.size]
    return (lambda: -lam @ gradient) if what == "reaction" else (lambda: -lam)
