"""How the entries of a mechanism file become calls of the methods of a mechanism."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from rom import rotation
from rom.arguments import unit_vector
from rom.config.document import Values
from rom.config.keys import Place, Variants, nearest
from rom.config.laws import Law, check_points, law_of
from rom.config.mechanism_keys import sections
from rom.config.python_files import function_of, plain_function_of
from rom.errors import ConfigError
from rom.fields import follow

if TYPE_CHECKING:
    from rom.mbs.elements.formulas.programs import Formula
    from rom.mbs.integrate.events import Instant
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.parts.bodies import Part

Measured = tuple[float, float]  # value and rate
GROUND = "ground"
DIRECTIONS = {"rising": 1, "falling": -1, "both": 0}


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry with its markers and joints found."""

    made: "Mechanism"
    section: str
    name: str
    ends: list[Any]  # markers, or joints
    marker_names: list[str]  # "body.marker", as written
    values: Values  # its other values, in SI
    place: Place
    t_end: float  # until when functions of time are asked for [s]
    trust: bool  # run functions of Python files

    def connect(self) -> None:
        """Call the method of the mechanism."""
        connect = sections()[self.section].connect or CALLS.get(self.section, _plainly)
        connect(self)

    def law(self, key: str) -> Law:
        """The law under a key."""
        return law_of(self.values[key], self.place.at(key), t_end=self.t_end, trust=self.trust)

    def times(self, constant: Any) -> Callable[[float], Any]:
        """The law under "factor" times a constant."""
        factor = self.law("factor").value
        return lambda t: float(factor(t)) * constant

    def take(self, record: Callable[..., Any]) -> Any:
        """A record of the values under the names of its fields, which leave the values."""
        names = [name for name in signature(record).parameters if name in self.values]
        return record(**{name: self.values.pop(name) for name in names})

    def take_body(self) -> "Part":
        """The flexible body under "body", which leaves the values."""
        name, parts = self.values.pop("body"), self.made.parts
        flexible = [key for key, part in parts.items() if part.flexible is not None]
        if name not in flexible:
            raise self.place.at("body").error(
                f"there is no flexible body {name!r}.",
                nearest(name, flexible) if flexible else "All bodies of the file are rigid.",
            )
        return parts[name]


def _plainly(entry: Entry) -> None:
    """The method that declares the keys, with the records that declare some behind the ends."""
    table: Any = sections()[entry.section].kind
    if isinstance(table, Variants):
        table = table.tables[entry.values.pop("kind")]
    method, *records = table.places
    body = [entry.take_body()] if "body" in entry.values else []
    given = [entry.take(follow(record)) for record in records]
    getattr(entry.made, method)(entry.name, *entry.ends, *body, *given, **entry.values)


def _drive(entry: Entry) -> None:
    law, (joint,) = entry.law("law"), entry.ends
    functions = {"rate": law.rate, "acceleration": law.acceleration}
    entry.made.drive(entry.name, joint, law.value, **functions)


def _motor(entry: Entry) -> None:
    law, (joint,) = entry.values["law"], entry.ends
    how = {key: entry.values.get(key) for key in ("coordinate", "every")}
    if not isinstance(law, Mapping):
        entry.made.motor(entry.name, joint, lambda t, x, rate: law, **how)
        return
    value: Any = entry.law("law").value
    if law["kind"] in ("expression", "python"):  # they take coordinate and rate
        entry.made.motor(entry.name, joint, value, **how)
        return
    entry.made.motor(entry.name, joint, lambda t, x, rate: float(value(t)), compiled=False, **how)


def _load(entry: Entry) -> None:
    vector: Any = np.array(entry.values["vector"])
    if "factor" in entry.values:
        vector = entry.times(vector)
    method = entry.section.removesuffix("s")
    how = {key: entry.values.get(key) for key in ("frame", "every")}
    getattr(entry.made, method)(entry.name, *entry.ends, vector, **how)


def _spread(entry: Entry) -> None:
    from rom.body.spread import mass_load, surface_load

    part, values = entry.take_body(), entry.values
    kind = values["kind"]
    if kind == "acceleration":
        load = mass_load(part.flexible, values[kind])
    else:
        load = surface_load(part.flexible, where=values.get("where"), **{kind: values[kind]})
    factor = entry.times(1.0) if "factor" in values else 1.0
    entry.made.spread_load(entry.name, part, load, factor, frame=values["frame"])


def _bushing(entry: Entry) -> None:
    for key in ("stiffness", "damping"):
        entry.values[key] = [*entry.values[key], *entry.values.pop(f"turning_{key}")]
    _plainly(entry)


def _line(entry: Entry) -> None:
    from rom.mbs.elements.formulas.lines import line_law
    from rom.mbs.elements.formulas.programs import formula

    one, two = entry.ends
    line_law(entry.made, entry.name, one, two, formula(entry.values["expression"]))


def _points(entry: Entry) -> None:
    from rom.mbs.elements.formulas.lines import line_law, through_points

    x, values = entry.values["x"], entry.values["values"]
    check_points(x, values, entry.place.at("x"))
    one, two = entry.ends
    force, potential = through_points(x, values, entry.values["interpolation"])
    line_law(entry.made, entry.name, one, two, force, potential)


def _python_law(entry: Entry) -> None:
    function = plain_function_of(entry.values, entry.place, trust=entry.trust)
    keys = ("parameters", "memory", "outputs", "energy", "every")
    given: Values = {key: entry.values.get(key) for key in keys}
    entry.made.law(entry.name, function, *entry.ends, **given)


def _user_force(entry: Entry) -> None:
    function = function_of(entry.values, entry.place, trust=entry.trust)
    if len(entry.ends) > 2:
        raise entry.place.at("markers").error(
            f"{len(entry.ends)} markers: a force acts on one, or between two.",
            'More of them may have kind = "python".',
        )
    entry.made.user_force(entry.name, function, *entry.ends, every=entry.values.get("every"))


@dataclass(frozen=True)
class Condition:
    """A measured value x with its rate v, and what of it must be zero."""

    kind: str  # "coordinate", "position" or "distance"
    follow: tuple[Any, ...]  # the joint with its coordinate, or the markers
    axis: Any  # (3,) unit vector, for a position
    value: float  # that x passes
    formula: "Formula | None"  # of t, x and v, in place of a value

    def __call__(self, t: float, instant: "Instant") -> float:
        """What passes through zero."""
        x, v = getattr(self, self.kind)(instant)
        return x - self.value if self.formula is None else self.formula(t, x, v)

    def coordinate(self, instant: "Instant") -> Measured:
        """Of a joint."""
        (joint,) = self.follow
        return instant.joint(joint) if isinstance(joint, str) else instant.joint(*joint)

    def position(self, instant: "Instant") -> Measured:
        """Of a marker along the axis."""
        (marker,) = self.follow
        place = instant.position(marker.body, marker)
        return float(self.axis @ place), float(self.axis @ instant.velocity(marker.body, marker))

    def distance(self, instant: "Instant") -> Measured:
        """Of two markers."""
        one, two = self.follow
        gap = instant.position(two.body, two) - instant.position(one.body, one)
        slide = instant.velocity(two.body, two) - instant.velocity(one.body, one)
        x = float(np.linalg.norm(gap))
        return x, float(gap @ slide) / x if x > 0.0 else 0.0


def condition_of(ends: list[Any], values: Values, place: Place) -> Condition:
    """The condition of an entry of [events]."""
    if ("value" in values) == ("expression" in values):
        what = "both a value and an expression" if "value" in values else "no value it passes"
        raise place.error(f"{place.name} has {what}.", "Give one of value and expression.")
    follow: tuple[Any, ...] = tuple(ends)
    if "coordinate" in values:
        follow = ((ends[0], values["coordinate"]),)
    axis = None
    if "axis" in values:
        axis = unit_vector(f"axis of {place.path[-1]}", values["axis"])
    formula = None
    if "expression" in values:
        from rom.mbs.elements.formulas.programs import formula as made

        formula = made(values["expression"])
    return Condition(values["kind"], follow, axis, values.get("value", 0.0), formula)


def _event(entry: Entry) -> None:
    direction, terminal = (entry.values.pop(key) for key in ("direction", "terminal"))
    how = {"direction": DIRECTIONS[direction], "terminal": terminal}
    if entry.values["kind"] == "python":
        function = function_of(entry.values, entry.place, trust=entry.trust)
        entry.made.event(entry.name, function, **how, follow=entry.ends)
        return
    condition = condition_of(entry.ends, entry.values, entry.place)
    entry.made.event(entry.name, condition, **how, follow=condition.follow)


CALLS: dict[str, Callable[[Entry], None]] = {
    "drives": _drive,
    "motors": _motor,
    "forces": _load,
    "torques": _load,
    "spread_loads": _spread,
    "bushings": _bushing,
    "laws": lambda entry: LAWS[entry.values.pop("kind")](entry),
    "events": _event,
}
LAWS: dict[str, Callable[[Entry], None]] = {
    "line": _line,
    "points": _points,
    "python": _python_law,
    "user_force": _user_force,
}


def check_name(name: str) -> None:
    """Refuse names of bodies and rods that markers could not name."""
    if "." in name or name == GROUND:
        raise ConfigError(f"{name!r} is no name for a body; use one without a dot, not {GROUND!r}.")


def pose_of(values: Values) -> Values:
    """Where the frame of a body is at the start, and how it moves."""
    given = ("at", "orientation", "velocity", "omega")
    pose: Values = {key: values[key] for key in given if key in values}
    turned = pose.get("orientation")
    if isinstance(turned, Mapping):
        axis = unit_vector("axis", turned["axis"])
        pose["orientation"] = rotation.exp(turned["angle"] * axis)
    return pose
