"""A controller in an FMU: what it is told of a motion once a sample, and what follows it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Protocol

import numpy as np

from rom.arguments import Positive, number
from rom.components.co_simulation.running import Running, variables
from rom.errors import ConfigError, SolverError
from rom.mbs.control.variables import readings, targets
from rom.mbs.elements.family import NEVER
from rom.mbs.elements.loads import at_marker
from rom.mbs.elements.motors import MOTORS_FAMILY
from rom.mbs.parts.foreign import KEPT_HINT, ask, numbers
from rom.mbs.parts.joints import Row, Whole, coordinate_of
from rom.model import Array
from rom.names import check_all_known, check_once

SAME_TIME = 1e-6  # of a sample


class Seen(Protocol):
    """An instant that tells positions, velocities, coordinates and reactions by their names."""

    t: float  # [s]


@dataclass
class Fmu:
    """An FMU and how it is connected; its process once it runs, and the time it has reached."""

    name: str
    path: Path
    every: float  # [s]
    time_limit: float  # [s]
    inputs: dict[str, Callable[[Seen], float]]
    parameters: dict[str, float]
    outputs: tuple[str, ...]
    coordinates: tuple[tuple[str, Row], ...]  # of joints, that it is told
    targets: frozenset[str]  # elements that follow it
    values: Array  # (n + 1,) outputs, and zero
    running: Running | None = None
    t: float = 0.0

    def ask(self, instant: Seen, due: float) -> None:
        """Let it go on to an instant, for which it was due at a time [s]; begin if never yet."""
        t, what, first = instant.t, f"FMU {self.name!r}", list[object]()
        values = [source(instant) for source in self.inputs.values()]
        if due == NEVER:
            self.running = Running(self.path, self.time_limit)
            first = [self.every, self.parameters, list(self.inputs), self.outputs]
        elif self.running is None or abs(self.t + self.every - due) > SAME_TIME * self.every:
            text = f"{what} does not stand one sample before t = {due:.9g} s, where it is to go on."
            raise ConfigError(text, hint="It keeps no states: begin anew, or where it ended.")
        try:
            answer = self.running.ask(t, values, *first)
        except SolverError as error:
            self.running = None
            said = f"{what} at t = {t:.9g} s: {error.message}."
            raise SolverError(said, hint=KEPT_HINT) from error
        self.values[:-1] = numbers(what, t, answer, (len(self.outputs),), "numbers")
        self.t = t


def fmu(
    self: Whole,
    file: str | Path,
    *,
    inputs: Mapping[str, object],
    outputs: Mapping[str, str],
    every: Annotated[float, Positive("s")],
    name: str | None = None,
    time_limit: Annotated[float, Positive("s")] = 60.0,
) -> None:
    """Let an FMU (FMI 2 or 3, co-simulation), run by fmpy, set motors and loads once a sample.

    At each sample it goes on to that time with its inputs as they were, is given the inputs of now
    and asked for its outputs, which are held up to the next one. It runs in a process of its own:
    whatever it does there, also nothing, ends the run by its name.

    Args:
        file: the unit, ending in ``.fmu``.
        inputs: {input: what it is told}, as columns of `rom.write_history` are named, such as
            "arm.tip position y", "hinge angle rate" or "hinge force x"; or a number, also for a
            parameter; or a function of time.
        outputs: {output: what follows it}: a motor, or a component of a force or torque as
            "push.x", in place of what that was given.
        every: as of `rom.mbs.elements.motors.motor` [s].
        name: of the unit; None for that of the file.
        time_limit: for each answer but the first, after which the run ends [s].

    Raises:
        ConfigError: for a name that is not there, or a target that is given twice.
        FileFormatError: if it is no such unit; UnsafeFileError if it unpacks elsewhere, or to more
            than 1 GB; ResourceError without fmpy, or without a library for this machine.
    """
    name = Path(file).stem if name is None else name
    self.check_new(name)
    known = variables(file)
    told = {key.replace(".", " "): x for key, x in readings(self)}
    able = {key.replace(".", " "): x for key, x in targets(self)}
    given = {**inputs, **{x: str(target) for x, target in outputs.items()}}
    words = {key: x.replace(".", " ") for key, x in given.items() if isinstance(x, str)}
    if not outputs:
        raise ConfigError(f"FMU {name!r} sets nothing; name outputs, and what follows them.")
    check_once([words[x] for x in outputs], f"the target of FMU {name!r}")
    for what, some in {"input parameter": inputs, "output": outputs}.items():
        there = [x for x, causality in known.items() if causality in what.split()]
        check_all_known(some, there, f"FMU {name!r} has no {what.split()[0]}")
    check_all_known([words[x] for x in inputs if x in words], told, f"FMU {name!r} cannot be told")
    check_all_known([words[x] for x in outputs], able, f"FMU {name!r} can set no motor or load")
    parameters = {x: number(x, inputs[x]) for x in inputs if known[x] == "parameter"}
    asked = [x for x in inputs if x not in parameters]
    sources = {x: _source(x, told[words[x]] if x in words else inputs[x]) for x in asked}
    picked, values = dict[str, list[int]](), np.zeros(len(outputs) + 1)
    for k, variable in enumerate(outputs):
        element, component = able[words[variable]]
        picked.setdefault(element, [len(outputs)] * 3)[component] = k
    for element, at in picked.items():
        family, one = self.elements.pop(element)
        if family is MOTORS_FAMILY:
            own = {"law": _held(values, at[0]), "compiled": None, "every": every}
            self.add(element, replace(one, **own), family)
        else:
            held = at_marker(_held(values, at), one.kind)
            self.user_force(element, held, one.marker, every=every)
    joints = {told[words[x]][1] for x in sources if x in words and told[words[x]][0] == "joint"}
    rows = tuple(
        (one, coordinate_of(self.joints, one, which, "FMU")) for one, which in sorted(joints)
    )
    how = sources, parameters, tuple(outputs), rows, frozenset(picked), values
    self.fmus[name] = Fmu(name, Path(file).resolve(), every, time_limit, *how)


def _held(values: Array, at: int | list[int]) -> Callable[..., Array]:
    """A law that says some of the values, whatever it is told."""
    return lambda *_: values[at]


def _source(variable: str, given: object) -> Callable[[Seen], float]:
    """What gives an input: a reading, a function of time or a number."""
    if isinstance(given, tuple):
        what, of, k = given
        return lambda instant: float(np.ravel(getattr(instant, what)(*of))[k])
    if not callable(given):
        fixed = number(variable, given)
        return lambda _: fixed
    what = f"the function of input {variable!r}"

    def at(instant: Seen) -> float:
        answer = ask(what, instant.t, given, instant.t)
        return float(numbers(what, instant.t, answer, (), "a number"))

    return at
