"""A mechanism that is moved from one communication point to the next."""

from dataclasses import replace
from typing import Any

import numpy as np

from rom.arguments import between, number, positive
from rom.errors import ConfigError, SolverError
from rom.fmu.inputs import Inputs
from rom.fmu.outputs import Outputs
from rom.io.fmu.variables import Variable
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.integrate.consistent_start import initial_state, with_accelerations
from rom.mbs.integrate.simulation import simulate
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.signals import sample_all
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import named

TIME_RTOL = 1e-9  # of a step: difference from the caller's time


class Driven:
    """A mechanism with inputs that are held over each step, and with outputs after it.

    Steps are those of `rom.simulate` with generalised-alpha and the same memory, so that inputs
    that never change give the bits of one long run, if drives know their derivatives. Where an
    input jumps, the accelerations, the acceleration-like variable of the method and the
    multipliers jump by the difference that the equations of motion give at that instant; without
    that the method would see every jump half a step late.

    Args:
        mechanism: it is changed.
        inputs: names of loads, spread loads, motors and drives that follow inputs.
        outputs: "body.marker", joints, drives.
        dt: longest time step [s].
        rho_inf: spectral radius of generalised-alpha at infinite frequency.

    Raises:
        ConfigError: for an unknown name.
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

    def set(self, refs: Any, values: Any) -> None:
        """Set parameters, before the first step only, and inputs.

        Raises:
            ConfigError: for a number that is not finite, an output, or a parameter too late.
        """
        known = self.variables
        for ref, value in zip(refs, values, strict=True):
            variable = known[ref] if 0 <= ref < len(known) else None
            if variable is None or variable.causality == "output":
                what = f"the output {variable.name!r}" if variable else f"value reference {ref}"
                raise ConfigError(f"{what} cannot be set; there are {len(known)} variables.")
            number(variable.name, value)
            if variable.causality == "parameter":
                self._set_parameter(int(ref), variable.name, float(value))
            else:
                self.inputs.values[ref - 2] = value

    def _set_parameter(self, k: int, name: str, value: float) -> None:
        if self.stepped:
            raise ConfigError(f"{name} must be set before the first step.")
        if k == 0:
            positive("dt", value)
        if k == 1:
            between("rho_inf", value, 0, 1)
        self.parameters[k] = value

    def get(self, refs: Any) -> Array:
        """Values of variables.

        Raises:
            ConfigError: for an unknown value reference.
        """
        first = 2 + self.inputs.values.size
        count = len(self.variables)
        wrong = [int(ref) for ref in refs if not 0 <= ref < count]
        if wrong:
            raise ConfigError(
                f"no variable has the value reference {named(wrong)}; all are < {count}."
            )
        outputs = self._outputs() if (np.asarray(refs) >= first).any() else np.zeros(count - first)
        every = np.concatenate([self.parameters, self.inputs.values, outputs])
        return every[np.asarray(refs, dtype=int)]

    def start(self, t: float) -> None:
        """Take the positions and velocities nearest to those given that satisfy all joints.

        Raises:
            ModelError: naming the joint that cannot be satisfied.
            SolverError: if a drive or load is not finite at the start.
        """
        self.inputs.begin(t)
        self.stepped = False
        state = initial_state(self.packed, t, 0.05 * float(self.parameters[0]), placing=True)
        if self.packed.by_blocks and state.rank < state.lam.size:
            self.packed = self.packed.whole()
            self.W = workspace(self.packed.system, len(self.packed.signals))
        self.state, self.held = state, self.inputs.values.copy()
        self.state = self._accelerated(state)

    def step(self, t: float, h: float) -> None:
        """Go on from t to t + h with steps of at most ``dt``.

        Raises:
            ConfigError: if the mechanism is not at t, or h is not positive.
            SolverError: naming time and culprit; the mechanism then stays where it is.
        """
        if self.state is None or abs(t - self.state.t) > TIME_RTOL * max(h, 1e-3 * abs(t)):
            where = "not started" if self.state is None else f"at t = {self.state.t:.9g} s"
            raise ConfigError(f"a step from t = {t:.9g} s must start at the mechanism, {where}.")
        positive("the communication step", h)
        n = max(1, int(np.ceil(h / float(self.parameters[0]) - 1e-6)))
        dt, begun = h / n, self._jumped(self.state)
        if begun.memory is not None and abs(begun.memory.h - dt) < TIME_RTOL * dt:
            dt = begun.memory.h  # callers subtract times; one step length needs one factorisation
        motion = simulate(
            self.mechanism,
            t_end=begun.t + n * dt,
            dt=dt,
            rho_inf=float(self.parameters[1]),
            save_every=n,
            state=begun,
        )
        if abs(motion.final.t - begun.t - h) > 2 * TIME_RTOL * h:
            raise SolverError(f"the mechanism ended its run: {motion.status}", solution=motion)
        self.state, self.held, self.stepped = motion.final, self.inputs.values.copy(), True
        self.inputs.follow(self.state.t)

    def keep(self) -> Any:
        """All that the next steps depend on, to come back to."""
        return self.state, self.stepped, self.held.copy(), self.inputs.kept()

    def recall(self, kept: Any) -> None:
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
        return replace(
            state,
            a=state.a + a,
            lam=state.lam + lam,
            algorithmic=state.algorithmic + a,
            memory=replace(state.memory, arrays=arrays),
        )

    def _outputs(self) -> Array:
        if self.state is None:
            raise ConfigError("the mechanism has no outputs yet: it must be initialised first.")
        return self.outputs.values(self._evaluated(self.state), self.state.lam, self.packed)
