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
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import between, number, positive
from rom.errors import ConfigError, RomError, RomWarning, SolverError
from rom.fmu.variables import Inputs, Outputs
from rom.fmu.variables import Kept as KeptInputs
from rom.io.fmu.description import Variable
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.integrate.consistent_start import initial_state, with_accelerations
from rom.mbs.integrate.simulation import simulate
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.signals import sample_all
from rom.mbs.results.state import State
from rom.model import Array, Index
from rom.names import named

TIME_RTOL = 1e-9  # of a step: difference from the caller's time
SETTINGS_FILE, BUILD_FUNCTION = "fmu.json", "mechanism"
OK, ERROR = 0, 3
HEAD_LAYOUT = struct.Struct("=iii")
NO_VALUES = np.zeros(0)
Kept = tuple[State | None, bool, Array, KeptInputs]  # all that the next steps depend on


class Driven:
    """A mechanism with inputs that are held over each step, and with outputs after it.

    Steps are those of `rom.simulate` with generalised-alpha and the same memory, so that inputs
    that never change give the bits of one long run, if drives know their derivatives. Where an
    input jumps, the accelerations, the acceleration-like variable of the method and the
    multipliers jump by the difference that the equations of motion give at that instant; without
    that the method would see every jump half a step late.

    The mechanism is changed; other arguments are those of `rom.fmu.export.write_fmu`.
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
        self.mechanism = mechanism
        self.parameters = np.array([dt, rho_inf], dtype=float)
        self.inputs, self.outputs = Inputs(mechanism, inputs), Outputs(mechanism, outputs)
        self.state: State | None = None
        self.stepped = False
        self.packed: Packed = pack(mechanism)
        self.W: Work = workspace(self.packed.system, len(self.packed.signals))
        self.laws = self.packed.asked
        self.held = self.inputs.values.copy()

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
        self.inputs.begin(t)
        self.stepped = False
        state = initial_state(self.packed, t, 0.05 * float(self.parameters[0]), placing=True)
        if self.packed.by_blocks and state.rank < state.lam.size:
            self.packed = self.packed.whole()
            self.W = workspace(self.packed.system, len(self.packed.signals))
        self.state, self.held = state, self.inputs.values.copy()
        self.state = self._accelerated(state)

    def step(self, t: float, h: float) -> None:
        """Go on from t to t + h with steps of at most ``dt``; where that fails, stay there."""
        if self.state is None or abs(t - self.state.t) > TIME_RTOL * max(h, 1e-3 * abs(t)):
            where = "not started" if self.state is None else f"at t = {self.state.t:.9g} s"
            raise ConfigError(f"a step from t = {t:.9g} s must start at the mechanism, {where}.")
        positive("the communication step", h)
        n = max(1, int(np.ceil(h / float(self.parameters[0]) - 1e-6)))
        dt, begun = h / n, self._jumped(self.state)
        if begun.memory is not None and abs(begun.memory.h - dt) < TIME_RTOL * dt:
            dt = begun.memory.h  # callers subtract times; one step length needs one factorisation
        t_end, rho_inf = begun.t + n * dt, float(self.parameters[1])
        motion = simulate(
            self.mechanism, t_end=t_end, dt=dt, state=begun, save_every=n, rho_inf=rho_inf
        )
        if abs(motion.final.t - begun.t - h) > 2 * TIME_RTOL * h:
            raise SolverError(f"the mechanism ended its run: {motion.status}", solution=motion)
        self.state, self.held, self.stepped = motion.final, self.inputs.values.copy(), True
        self.inputs.follow(self.state.t)

    def keep(self) -> Kept:
        """All that the next steps depend on, to come back to."""
        return self.state, self.stepped, self.held.copy(), self.inputs.kept()

    def recall(self, kept: Kept) -> None:
        """Come back to what was kept."""
        self.state, self.stepped, held, inputs = kept
        self.held = held.copy()
        self.inputs.recall(inputs)

    def _evaluated(self, state: State) -> Work:
        W, span = self.W, (state.t, np.inf)
        spacing = 0.05 * float(self.parameters[0])
        W.signal[:] = sample_all(self.packed.signals, np.array([state.t]), span, spacing)[0]
        W.base[:] = np.r_[0 * W.x, self.packed.system.memory] if state.base is None else state.base
        evaluate(self.packed.system, W, state.q, state.v)
        return W

    def _accelerated(self, state: State) -> State:
        """The state with accelerations and multipliers of the inputs as they are."""
        W = self._evaluated(state)
        apply_laws(self.laws, W, state.t)
        return with_accelerations(self.packed, W, state)

    def _jumped(self, state: State) -> State:
        """The state with what the change of inputs since the last step does to accelerations."""
        if state.memory is None or np.array_equal(self.held, self.inputs.values):
            return state
        after, now = self._accelerated(state), self.inputs.values.copy()
        self.inputs.values[:] = self.held
        before = self._accelerated(state)
        self.inputs.values[:] = now
        a, lam = after.a - before.a, after.lam - before.lam
        arrays = state.memory.arrays | {"before": state.memory.arrays["before"] + a}
        memory, algorithmic = replace(state.memory, arrays=arrays), state.algorithmic + a
        moved = replace(state, a=state.a + a, lam=state.lam + lam)
        return replace(moved, algorithmic=algorithmic, memory=memory)

    def _outputs(self) -> Array:
        if self.state is None:
            raise ConfigError("the mechanism has no outputs yet: it must be initialised first.")
        return self.outputs.values(self._evaluated(self.state), self.state.lam, self.packed)


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
