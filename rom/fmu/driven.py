"""A mechanism that is moved from one communication point to the next, asked over a socket.

A request is three int32 (verb, number of references, number of values), then the references as
uint32 and the values as doubles. An answer is three int32 (status, number of values, length of the
text), then values and text, which is an error or, with the status OK, a warning. The verbs are
those of ``rom/io/fmu/c/process.c``.
"""

import importlib.util
import json
import socket
import struct
import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import between, number, positive
from rom.errors import ConfigError, RomError, RomWarning
from rom.io.fmu.description import Variable
from rom.mbs.control.stepper import Stepper
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array, Index
from rom.names import named

TIME_RTOL = 1e-9  # of a step: difference from the caller's time
SETTINGS_FILE, BUILD_FUNCTION = "fmu.json", "mechanism"
OK, ERROR = 0, 3
HEAD_LAYOUT = struct.Struct("=iii")
NO_VALUES = np.zeros(0)
Kept = tuple[State | None, bool, Array]  # state, whether steps were taken, inputs


class Driven:
    """A mechanism with inputs that are held over each communication step, and outputs after it.

    Arguments are those of `rom.fmu.export.write_fmu`.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        *,
        inputs: tuple[str, ...] = (),
        outputs: tuple[str, ...] = (),
        dt: float,
        rho_inf: float = 0.9,
    ):
        self.parameters = np.array([dt, rho_inf], dtype=float)
        self.stepper = Stepper(mechanism, dt=dt, inputs=inputs, outputs=outputs, rho_inf=rho_inf)
        self.inputs, self.outputs = self.stepper.inputs, self.stepper.outputs
        self.started = self.stepped = False

    @property
    def variables(self) -> list[Variable]:
        """Parameters, inputs, outputs, in the order of their value references."""
        dt, rho_inf = (float(x) for x in self.parameters)
        return [
            Variable("dt", "parameter", "s", dt, "longest time step"),
            Variable("rho_inf", "parameter", "1", rho_inf, "spectral radius at infinity, 0 to 1"),
            *self.inputs.variables,
            *self.outputs.variables,
        ]

    def set(self, refs: Iterable[int], values: Iterable[float]) -> None:
        """Set parameters, before the first step only, and inputs."""
        known = self.variables
        for ref, value in zip(refs, values, strict=True):
            variable = known[ref] if 0 <= ref < len(known) else None
            if variable is None or variable.causality == "output":
                what = f"the output {variable.name!r}" if variable else f"value reference {ref}"
                raise ConfigError(f"{what} cannot be set; there are {len(known)} variables.")
            number(variable.name, value)
            if variable.causality == "input":
                self.inputs.values[ref - 2] = value
                continue
            if self.stepped:
                raise ConfigError(f"{variable.name} must be set before the first step.")
            if ref == 0:
                positive("dt", value)
            else:
                between("rho_inf", value, 0, 1)
            self.parameters[ref] = value

    def get(self, refs: Index) -> Array:
        """Values of variables."""
        first, count = 2 + self.inputs.values.size, len(self.variables)
        if wrong := [int(ref) for ref in refs if not 0 <= ref < count]:
            raise ConfigError(
                f"no variable has the value reference {named(wrong)}; all are < {count}."
            )
        outputs = self._outputs() if (np.asarray(refs) >= first).any() else np.zeros(count - first)
        every = np.concatenate([self.parameters, self.inputs.values, outputs])
        return every[np.asarray(refs, dtype=int)]

    def start(self, t: float) -> None:
        """Take the positions and velocities nearest to those given that satisfy all joints."""
        self.stepper.dt, self.stepper.rho_inf = self.parameters.tolist()
        self.stepper.start(t, placing=True)
        self.started, self.stepped = True, False

    def step(self, t: float, h: float) -> None:
        """Go on from t to t + h with steps of at most ``dt``; where that fails, stay there."""
        now = self.stepper.t
        if not self.started or abs(t - now) > TIME_RTOL * max(h, 1e-3 * abs(t)):
            where = f"at t = {now:.9g} s" if self.started else "not started"
            raise ConfigError(f"a step from t = {t:.9g} s must start at the mechanism, {where}.")
        positive("the communication step", h)
        n = max(1, int(np.ceil(h / float(self.parameters[0]) - 1e-6)))
        # callers subtract times; one step length needs one factorisation
        same = abs(self.stepper.h - h / n) < TIME_RTOL * h / n
        self.stepper.advance(n, self.stepper.h if same else h / n)
        self.stepped = True

    def keep(self) -> Kept:
        """All that the next steps depend on, to come back to."""
        state = self.stepper.state if self.started else None
        return state, self.stepped, self.inputs.values.copy()

    def recall(self, kept: Kept) -> None:
        """Come back to what was kept."""
        state, self.stepped, values = kept
        self.started = state is not None
        if state is not None:
            self.stepper.recall(state)
        self.inputs.values[:] = values

    def _outputs(self) -> Array:
        if not self.started:
            raise ConfigError("the mechanism has no outputs yet: it must be initialised first.")
        return self.stepper.read()


def driven(resources: Path) -> Driven:
    """The mechanism that the resources of an FMU describe."""
    settings = json.loads((resources / SETTINGS_FILE).read_text())
    script = resources / settings["script"]
    sys.path.insert(0, str(script.parent))
    spec: Any = importlib.util.spec_from_file_location(script.stem, script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    build = getattr(module, BUILD_FUNCTION, None)
    if not callable(build):
        raise ConfigError(f"{script.name} needs a function {BUILD_FUNCTION}() for the mechanism.")
    mechanism = build()
    if not isinstance(mechanism, Mechanism):
        raise ConfigError(f"{BUILD_FUNCTION}() gave {mechanism!r}; it must return a Mechanism.")
    names = {key: tuple(settings[key]) for key in ("inputs", "outputs")}
    return Driven(mechanism, **names, dt=settings["dt"], rho_inf=settings["rho_inf"])


class Server:
    """Answers requests about one mechanism, which ``build`` makes as it is before the start."""

    def __init__(self, build: Callable[[], Driven]):
        self.build, self.model = build, build()
        self.states: dict[int, Kept] = {}
        self.count = 0
        self.reported: set[str] = set()
        self.verbs: dict[int, Callable[[Index, Array], Array | None]] = {
            1: lambda refs, values: self.model.set(refs, values),
            2: lambda refs, values: self.model.get(refs),
            3: lambda refs, values: self.model.start(float(values[0])),
            4: lambda refs, values: self.model.step(float(values[0]), float(values[1])),
            5: self._keep,
            6: self._recall,
            7: self._drop,
            8: self._reset,
        }

    def answer(self, verb: int, refs: Index, values: Array) -> tuple[int, Array, str]:
        """Status, values and message; never an exception, for the caller is another program.

        A warning comes once for each instance, as the message of an answer that is OK.
        """
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                found = self.verbs[verb](refs, values)
            except RomError as error:
                return ERROR, NO_VALUES, str(error)
            except Exception as error:  # whatever the user's own functions raise
                return ERROR, NO_VALUES, f"{type(error).__name__}: {error}"
        new = {str(w.message) for w in caught if issubclass(w.category, RomWarning)} - self.reported
        self.reported |= new
        return OK, NO_VALUES if found is None else found, " ".join(sorted(new))

    def _keep(self, refs: Index, values: Array) -> Array:
        self.count += 1
        self.states[self.count] = self.model.keep()
        return np.array([float(self.count)])

    def _recall(self, refs: Index, values: Array) -> None:
        if int(values[0]) not in self.states:
            raise ConfigError("this state was freed, or of another instance; take a kept one.")
        self.model.recall(self.states[int(values[0])])

    def _drop(self, refs: Index, values: Array) -> None:
        self.states.pop(int(values[0]), None)

    def _reset(self, refs: Index, values: Array) -> None:
        self.model = self.build()


def serve(connection: socket.socket, build: Callable[[], Driven]) -> None:
    """Answer until the other end closes; the first answer says whether the mechanism is there."""
    try:
        server = Server(build)
    except Exception as error:  # the Python file is the user's
        kind = "" if isinstance(error, RomError) else f"{type(error).__name__}: "
        _send(connection, ERROR, NO_VALUES, f"{kind}{error}")
        return
    _send(connection, OK, NO_VALUES, "")
    with connection.makefile("rb") as requests:
        while len(head := requests.read(HEAD_LAYOUT.size)) == HEAD_LAYOUT.size:
            verb, n_refs, n_values = HEAD_LAYOUT.unpack(head)
            size = 4 * n_refs + 8 * n_values
            if len(data := requests.read(size)) < size:
                return
            refs = np.frombuffer(data, np.uint32, n_refs).astype(np.int64)
            values = np.frombuffer(data, float, n_values, 4 * n_refs)
            _send(connection, *server.answer(verb, refs, values))


def _send(connection: socket.socket, status: int, values: Array, text: str) -> None:
    words = text.encode()
    head = HEAD_LAYOUT.pack(status, values.size, len(words))
    connection.sendall(head + np.ascontiguousarray(values, dtype=float).tobytes() + words)
