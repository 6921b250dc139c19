"""Functions of time in a file: constant, steady, run-up, ramp, harmonic, table, formula, Python."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.arguments import Ascending, Positive, Quantity
from rom.config.document import Values
from rom.config.expressions import formula_kind
from rom.config.keys import Either, Key, Kind, Place, Table, Variants, raise_mistakes, read_value
from rom.config.python_files import PYTHON_KEYS, function_of
from rom.errors import ConfigError

LAWS = {
    "constant": "Always the same.",
    "steady": "start + rate t.",
    "run-up": "From rest to a steady rate, without a jolt: the rate is that of a cycloid, "
    "rate (s - sin(2 pi s) / 2 pi) with s = t / duration.",
    "ramp": "From one value to another on a cycloid, from + (to - from) (s - sin(2 pi s) / 2 pi) "
    "with s = (t - start) / duration.",
    "harmonic": "mean + amplitude sin(2 pi frequency t + phase).",
    "table": "A cubic spline through points; it must cover the whole run.",
    "expression": "A formula; its rate and acceleration are exact.",
    "python": "which runs only with `--trust` or `trust=True`.",
}
Function = Callable[[Any], Any]


@dataclass(frozen=True, slots=True)
class Law:
    """A function of time of numbers or arrays, with its derivatives; those in Python have none."""

    value: Function
    rate: Function | None
    acceleration: Function | None


def law_kind(unit: str, variables: tuple[str, ...] = ("t",)) -> Kind:
    """How a law is written whose values have this SI unit; formulas may have other variables."""
    value, rate = Quantity(unit), Quantity("1/s" if unit == "1" else f"{unit}/s")
    keys = {
        "constant": [Key("value", value, "Its value.", ...)],
        "steady": [
            Key("rate", rate, "Change per time.", ...),
            Key("start", value, "Value at t = 0.", 0.0),
        ],
        "run-up": [
            Key("rate", rate, "Rate at the end.", ...),
            Key("duration", Positive("s"), "Time until then.", ...),
        ],
        "ramp": [
            Key("from", value, "Value before.", 0.0),
            Key("to", value, "Value after.", ...),
            Key("start", Quantity("s"), "When it begins.", 0.0),
            Key("duration", Positive("s"), "How long it takes.", ...),
        ],
        "harmonic": [
            Key("amplitude", value, "Amplitude.", ...),
            Key("frequency", Positive("Hz"), "Frequency.", ...),
            Key("phase", Quantity("rad"), "Phase.", 0.0),
            Key("mean", value, "Mean.", 0.0),
        ],
        "table": [
            Key("t", Ascending("s"), "Times.", ...),
            Key("values", Quantity(unit, ((None,),)), "Values.", ...),
        ],
    }
    tables = {kind: Table(LAWS[kind], tuple(some)) for kind, some in keys.items()}
    tables["expression"] = formula_kind(unit, variables, LAWS["expression"])
    about = f"A function of ({', '.join(variables)}) in a Python file, {LAWS['python']}"
    tables["python"] = Table(about, PYTHON_KEYS)
    return Either(value, Variants(tables, {"expression": "expression", "function": "python"}))


@dataclass(frozen=True, slots=True)
class Pending:
    """A value whose unit depends on whether a joint turns or slides."""

    value: object
    place: Place
    kinds: tuple[Kind, Kind]

    def of(self, *, turns: bool) -> Any:
        """The value for an angle, or for a way."""
        place = Place(self.place.document, self.place.path)
        found = read_value(self.kinds[0 if turns else 1], self.value, place)
        raise_mistakes(place)
        return found


@dataclass(frozen=True, slots=True)
class ByCoordinate:
    """A kind with one unit for joints that turn, another for joints that slide."""

    turning: Kind
    sliding: Kind

    @property
    def summary(self) -> str:
        """Both kinds."""
        return f"{self.turning.summary}; of a joint that slides {self.sliding.summary}"

    def read(self, value: object, place: Place) -> Pending:
        """The value, which fits at least one of them."""
        pending = Pending(value, place, (self.turning, self.sliding))
        try:
            pending.of(turns=True)
        except ConfigError:
            pending.of(turns=False)
        return pending


def law_of(values: Any, place: Place, *, t_end: float | None = None, trust: bool = False) -> Law:
    """The functions of a law, as `law_kind` has read it, asked for until t_end [s]."""
    values = dict(values) if isinstance(values, Mapping) else {"kind": "constant", "value": values}
    kind = values.pop("kind")
    if kind == "constant":
        return _polynomial(values["value"], 0.0)
    if kind == "steady":
        return _polynomial(values["start"], values["rate"])
    if kind == "expression":
        from rom.mbs.elements.formulas.programs import formula

        found = formula(values["expression"])
        return Law(found, found.rate, found.acceleration)
    if kind == "python":
        return Law(function_of(values, place, trust=trust), None, None)
    if kind == "table":
        from scipy.interpolate import CubicSpline

        t = values["t"]
        check_points(t, values["values"], place)
        if t_end is not None and not (t[0] <= 0.0 and t[-1] >= t_end):
            text = f"the points of {place.name} cover {t[0]:g} s to {t[-1]:g} s"
            raise place.error(f"{text}; the run needs 0 s to {t_end:g} s.")
        spline = CubicSpline(np.array(values["t"]), np.array(values["values"]))
        return Law(spline, spline.derivative(1), spline.derivative(2))
    if kind == "harmonic":
        return _harmonic(values)
    from rom.mbs.parts.signals import run_up, transition

    if kind == "run-up":
        return Law(*run_up(**values))
    return Law(*transition(values.pop("from"), values.pop("to"), **values))


def _polynomial(start: float, slope: float) -> Law:
    return Law(lambda t: start + slope * t, lambda t: slope + 0 * t, lambda t: 0.0 * t)


def _harmonic(values: Values) -> Law:
    A, w, phase = values["amplitude"], 2 * np.pi * values["frequency"], values["phase"]
    return Law(
        lambda t: values["mean"] + A * np.sin(w * t + phase),
        lambda t: w * A * np.cos(w * t + phase),
        lambda t: -(w**2) * A * np.sin(w * t + phase),
    )


def check_points(x: list[float], y: list[float], place: Place) -> None:
    """Refuse points of a curve that lack values."""
    if len(x) != len(y):
        raise place.error(f"{place.name} needs as many values, not {len(y)} for {len(x)}.")
