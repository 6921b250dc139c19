"""Steps of a mechanism one by one, for controllers and learning: inputs in, outputs out."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from math import isfinite
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import AnyMechanism, Positive, Share, finite, typed, typed_record
from rom.errors import ConfigError, RomError, SolverError
from rom.mbs.control.variables import Inputs, Outputs, View
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.integrate.fixed_step import failed_step
from rom.mbs.integrate.run import Record, Settings
from rom.mbs.integrate.sampling import begin_sampled, check_samples, samples_of, steps_up_to_sample
from rom.mbs.integrate.simulation import check_fit
from rom.mbs.integrate.step_memory import FACTOR_FIELDS, signals_at, state_of
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.work import Step, Work, workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.foreign import KEPT_HINT
from rom.mbs.parts.signals import Span, first_failure, padded, sampled
from rom.mbs.results.state import State
from rom.model import Array
from rom.notebook import listed

AHEAD = 512  # steps at once for which functions of time are asked
NEWTON_RTOL = 1e-9  # as of rom.simulate
NO_TIMES = np.zeros(0)
SAME_STEP = 1e-6  # of a step, by which a time may miss a multiple of it
# what states of a stepper remember beside their method: inputs, the past of drives as inputs, and
# coordinates that are followed for outputs alone
HELD_KEY, PAST_KEY, WATCHED_KEY = "inputs held", "drives held", "watched"


class Unending(Settings):
    """Settings of steps of one length that nobody ends."""

    __slots__ = ()

    @property
    def span(self) -> Span:
        """From the start on."""
        return self.t_start, np.inf

    @property
    def spacing(self) -> float:
        """Spacing of the finite differences of prescribed functions [s]."""
        return 0.05 * self.h


@typed_record
class Stepper:
    """A mechanism that is moved step by step, by whoever decides about its inputs in between.

    Nothing is recorded, and arrays are used again: a step costs little more than that of a run.
    Steps are those of `rom.simulate` with generalised-alpha and have its bits as long as inputs
    stay as they are, if drives know their derivatives. Where an input jumps, the accelerations,
    the acceleration-like variable of the method and the multipliers jump by the difference that
    the equations of motion give at that instant; without that the method would see every jump half
    a step late.

    It moves a copy of the mechanism, so that several steppers do not know of each other. Functions
    of time that are no inputs are asked some steps ahead.

    Args:
        mechanism: what moves.
        dt: time step [s].
        inputs: names of loads (three numbers, N or N m), spread loads (factor), motors (N or N m),
            drives (acceleration, m/s^2 or rad/s^2) and of laws with parameters (all of them), whose
            own values they replace; they are held over a step.
        outputs: "body.marker" for position (3), velocity (3), quaternion (4) and angular velocity
            (3) in the world; a joint for angle and way with their rates, counted over whole turns;
            a drive for the load it supplies; else what columns of `rom.write_history` are called or
            begin with: "arm.tip position y", "hinge angle rate", "hinge force", "arm elastic"; or
            "arm stress 7", at a point of the surface of a body with stress recovery.
        every: time that one call of `step` covers, a multiple of dt [s]; None for one time step.
        rho_inf: spectral radius of generalised-alpha at infinite frequency [1].

    Attributes:
        input_names, output_names: of all their numbers, in order.
        t: time reached [s].

    Raises:
        ConfigError: for an unknown name, a time that is no multiple of dt, or an event that would
            end the motion.

    Example:
        >>> mech, solid = rom.Mechanism(), {"mass": 1.0, "inertia": (0.5, 0.5, 0.5)}
        >>> wheel = mech.add_rigid("wheel", **solid, at=(0, 0, 0))
        >>> mech.revolute("hinge", "ground", "wheel", axis=(0, 0, 1))
        >>> mech.motor("servo", "hinge", lambda t, angle, rate: 0.0)
        >>> stepper = rom.Stepper(mech, dt=0.1, inputs=["servo"], outputs=["hinge"])
        >>> stepper.step([1.0]).round(9)  # 2 rad/s^2 for 0.1 s
        array([0.01, 0.2 ])
    """

    def __init__(
        self,
        mechanism: AnyMechanism,
        *,
        dt: Annotated[float, Positive("s")],
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
        every: Annotated[float, Positive("s")] | None = None,
        rho_inf: Share = 0.9,
    ):
        self.dt, self.rho_inf, self.given = dt, rho_inf, mechanism
        self.count = 1 if every is None else round(every / dt)
        if self.count < 1 or (every and abs(self.count * dt - every) > SAME_STEP * dt):
            raise ConfigError(f"every = {every:g} s must be a multiple of dt = {dt:g} s.")
        if ends := [name for name, event in mechanism.events.items() if event.terminal]:
            text = f"event {ends[0]!r} would end the motion, and a stepper looks for no events"
            raise ConfigError(f"{text}.", hint="Leave it out, and look at the outputs.")
        self.mechanism, self._contents = _copied(mechanism), _contents(mechanism)
        self.inputs = Inputs(self.mechanism, tuple(inputs))
        self.outputs = Outputs(self.mechanism, tuple(outputs))
        self.input_names = tuple(variable.name for variable in self.inputs.variables)
        self.output_names = tuple(variable.name for variable in self.outputs.variables)
        self._initial: State | None = None
        self._state: State | None = None  # that the steps of this length began from
        self._begun_from: State | None = None  # that the next step is to begin from
        self._held, self._t, self._factorised = self.inputs.start.tobytes(), 0.0, -1
        self._take(pack(self.mechanism, sampled=True, watched=self.outputs.followed))

    def step(self, values: npt.ArrayLike = ()) -> Array:
        """Hold the inputs at values (n,) over a step; returns the outputs (m,), for `output_names`.

        The array is filled anew by the next step: copy what is to stay. Where the step fails, the
        mechanism stays where it was, from where it goes on with other inputs or after `reset`.

        Raises:
            ConfigError: for another number of values, or one that is not finite.
            SolverError: if the equations cannot be solved; and what functions of the user raise.
        """
        try:
            given = np.asarray(values, dtype=float)
            good = given.shape == self.inputs.start.shape and all(map(isfinite, given.tolist()))
        except (TypeError, ValueError, OverflowError):
            good = False
        if not good:
            finite(f"values {listed(self.input_names)}", values, self.inputs.start.shape)
        if self._state is None:
            self.reset()
        self.inputs.values[...] = given
        self.advance(self.count, self.dt)
        return self.outputs.read()

    @typed
    def reset(self, state: State | None = None) -> Array:
        """Go back to the start, or to a state; returns the outputs (m,) there.

        Inputs are as the mechanism has them; in a state of this stepper as they were, and it goes
        on to the same bits. States of runs and equilibria of the same mechanism are good, too.

        Raises:
            ConfigError: for a state of another mechanism, or if it was changed since the stepper
                was made.
            ModelError: if joints contradict each other, or what was given at the start.
        """
        if _contents(self.given) != self._contents:
            text = "the mechanism was changed since its stepper was made, which moves it as it was"
            raise ConfigError(f"{text}.", hint="Make a new rom.Stepper.")
        if state is not None:
            self.recall(state)
            return self.read()
        self.inputs.values[:] = self.inputs.start
        if self._initial is None:
            self.start()
            self._initial = self._state
        else:
            self.inputs.begin(self._initial.t)
            self._stand(self._initial)
        return self.read()

    @property
    def state(self) -> State:
        """Where it is and all that the next steps depend on, for `reset` and `rom.simulate`."""
        if self._state is None:
            self.reset()
        found = self._whole_state()
        c, watched = self._W.x.size, self._packed.places.watched
        extra = slice(c - watched, c)
        base = np.delete(self._W.base, extra)
        if found.memory is None:
            return replace(found, base=base)
        arrays = found.memory.arrays | {HELD_KEY: np.frombuffer(self._held).copy()}
        arrays[PAST_KEY] = np.array(self.inputs.past, dtype=float).reshape(-1, 3)
        arrays[WATCHED_KEY] = self._W.base[extra].copy()
        return replace(found, base=base, memory=replace(found.memory, arrays=arrays))

    @property
    def t(self) -> float:
        """Time reached [s]."""
        return self._t

    def start(self, t: float = 0.0, *, placing: bool = False) -> None:
        """Stand at the start with the inputs as they are; ``placing`` as of `initial_state`."""
        self.inputs.begin(t)
        self.inputs.tell()
        self._stand(initial_state(self._packed, t, 0.05 * self.dt, placing=placing))

    def recall(self, state: State) -> None:
        """Stand at a state, of this stepper or another motion of the mechanism."""
        kept = {} if state.memory is None else state.memory.arrays
        watched = self._packed.places.watched
        if state.base is not None:
            extra = kept.get(WATCHED_KEY, np.zeros(0))
            extra = extra if extra.size == watched else np.zeros(watched)
            needed = min(self._W.x.size - watched, np.size(state.base))
            state = replace(state, base=np.insert(state.base, [needed] * watched, extra))
        check_fit(state, self._packed, self.mechanism)
        sizes = [np.size(kept.get(key, ())) for key in (HELD_KEY, PAST_KEY)]
        if HELD_KEY in kept and sizes == [self.inputs.start.size, 3 * len(self.inputs.past)]:
            self.inputs.values[:] = kept[HELD_KEY]
            self._held = self.inputs.values.tobytes()
            self.inputs.past = kept[PAST_KEY].tolist()
        else:
            self.inputs.values[:] = self.inputs.start
            self.inputs.begin(state.t)
            if self._held:  # nobody knows from which values they jump
                state = replace(state, memory=None, algorithmic=None)
        self._stand(state)

    def read(self) -> Array:
        """(m,) outputs where it stands."""
        self._look()
        return self.outputs.read()

    def advance(self, n: int, h: float) -> None:
        """Go on by n steps of length h with the inputs as they are; where that fails, stay."""
        if self._begun_from is not None or self.h != h:
            self._begin(h)
        inputs, self._kept[...] = self.inputs, self._numbers
        if self._step.count[entry.FACTORISATIONS] != self._factorised:
            self._factorised = int(self._step.count[entry.FACTORISATIONS])
            for x, kept in self._factor:  # in whose place a step that fails has another one
                kept[:] = x
        t, past, now = self._t, inputs.past if inputs.drives else [], inputs.values.tobytes()
        try:
            inputs.tell()
            if jumps := now != self._held:
                self._look_at_jump()
            self._go(n, jumps)
        except BaseException as raised:
            if isinstance(raised, RomError):
                raised.hint = raised.hint.replace(KEPT_HINT, "The stepper stands before the step.")
            for x, kept in ((self._numbers, self._kept), *self._factor):
                x[:] = kept
            self._t, self._times, self._seen, inputs.past = t, NO_TIMES, False, past
            raise
        self._held = now

    def _take(self, packed: Packed) -> None:
        """Make room for a mechanism, and find in it what inputs and outputs speak of."""
        self._packed = packed
        seen = packed.system.replace(markers=packed.seen.markers)
        self._system, signals = seen, len(packed.signals)
        W, self._S = workspace(packed.system, signals), workspace(seen, signals)
        self._step, self._W, self._numbers = _room(packed, W)
        self._kept = self._numbers.copy()
        names = (*FACTOR_FIELDS, "factor", "lu")
        self._factor = [(x, x.copy()) for x in (getattr(W, name) for name in names)]
        self._samples, self.h = bool(samples_of(packed)), 0.0  # length of its last step [s]
        self.inputs.bind(packed)
        self.outputs.bind(View(packed, self.mechanism.parts, self._S, self._step))

    def _stand(self, state: State) -> None:
        """Let the next step begin from a state."""
        packed = self._packed.of_rank(state.rank)
        if packed is not self._packed:
            self._take(packed)
        if state.base is None:
            state = replace(state, base=np.r_[0.0 * self._W.x, packed.system.memory])
        arrays = {"q": state.q, "v": state.v, "vd": state.a, "lam": state.lam}
        for name, x in arrays.items():
            getattr(self._step, name)[:] = x
        self._W.base[:] = state.base
        self._state = self._begun_from = state
        self._t, self._seen = state.t, False

    def _whole_state(self) -> State:
        """The state with coordinates that are followed for outputs alone."""
        if self._begun_from is not None:
            return self._begun_from
        self._record.t = self._t
        return state_of(self._record, self._W, self._step)

    def _begin(self, h: float) -> None:
        """Fill the step memory for a first step of length h."""
        state = self._begun_from = self._whole_state()
        W, packed = self._W, self._packed
        numbers = (1, self.rho_inf, NEWTON_RTOL, 1.0, 1.0, False)
        settings = Unending(state.t, state.t + h, h, *numbers).after(state)
        settings = replace(settings, save_every=alpha.NEVER)
        check_samples(packed, settings)
        self._record = Record(self.mechanism, packed, settings, 0.0, t=state.t, given=state)
        self._record.final = state
        if state.algorithmic is None:
            self._held = self.inputs.values.tobytes()
        self.inputs.tell()
        made, self._record.final = begin_sampled(self._record, W, state, packed.asked)
        alpha.advance.link()
        for name, x in made.items():
            getattr(self._step, name)[...] = x
        signals_at(self._record, self._S, state.t)
        self._state, self._begun_from, self.h = state, None, h
        self._times, self._at, self._factorised = NO_TIMES, 0, -1

    def _look(self) -> None:
        """Evaluate the mechanism where it stands, in memory of its own."""
        if not self._seen:
            self._S.base[:] = self._W.base
            evaluate(self._system, self._S, self._step.q, self._step.v)
            self._seen = True

    def _look_at_jump(self) -> None:
        """Evaluate where it stands under inputs that have changed since the last step."""
        self._look()
        S, inputs = self._S, self.inputs
        if inputs.drives:
            now = inputs.values.copy()
            inputs.values[:] = np.frombuffer(self._held)
            inputs.follow(self._t)
            inputs.values[:] = now
        if inputs.signals:
            inputs.write(np.array([self._t]), S.signal[None])
        apply_laws(self._packed.asked, S, self._t)

    def _go(self, n: int, jumps: bool) -> None:
        """Take n steps."""
        record, W, step, asked = self._record, self._W, self._step, self._packed.asked
        while n:
            most = n
            if self._samples:
                record.t = self._t
                record.reach(state_of(record, W, step))
                most = 0 if jumps else steps_up_to_sample(record, W, step, asked, n)
            self._ahead(most)
            while (answer := alpha.go_on(self._moved, self._at, most, jumps)) != alpha.CONVERGED:
                t = record.settings.time(int(step.count[entry.STEPS]) + 1)
                if answer != alpha.NEEDS_LAWS:
                    raise failed_step(record, W, step, answer, t)
                apply_laws(asked, W, t, slopes=not step.count[entry.HAS_FACTOR])
            self._at, self._seen, n, jumps = self._at + most, True, n - most, False
            self._t = self._times.item(self._at)

    def _ahead(self, n: int) -> None:
        """Have the signals of the next n steps, with the inputs as they are."""
        if self._at + n >= self._times.size:
            self._sample(max(n, AHEAD))
        rows = slice(self._at, self._at + n)
        if rows.stop > self._good:
            raise self._failure or SolverError(f"no signals beyond t = {self._t:.9g} s.")
        if self.inputs.signals:
            self.inputs.write(self._times[1:][rows], self._signals[rows])

    def _sample(self, n: int) -> None:
        """Ask the functions of time that are no inputs for the next n steps."""
        settings, done = self._record.settings, int(self._step.count[entry.STEPS])
        self._times = settings.time(np.arange(done, done + n + 1))
        t = self._times[1:]
        others = tuple(self._packed.signals[k] for k in self.inputs.others)
        table, failure = sampled(others, padded(t), settings.span, settings.spacing)
        good = min(len(table), n)
        if good:
            seen = (float(t[0] - settings.h), float(t[-1]))
            looked, late = first_failure(others, t[:good], table[:good], seen, settings.h)
            good, failure = looked, late if looked < good else failure
        self._signals = np.zeros((n, len(self._packed.signals), 3))
        self._signals[:good, self.inputs.others] = table[:good]
        self._at, self._good, self._failure = 0, good, failure
        memory = self._packed.system, self._W, self._step, self._system, self._S, self._signals
        self._moved = alpha.Moved(*memory, self._packed.rows_solved(self._record.final.rank))


def _copied(mechanism: Mechanism) -> Mechanism:
    """The same in dictionaries of its own, whose entries can be exchanged."""
    own = copy(mechanism)
    vars(own).update({name: dict(x) for name, x in vars(own).items() if isinstance(x, dict)})
    return own


def _contents(mechanism: Mechanism) -> list[object]:
    """What tells whether something was added, exchanged or removed."""
    inside = [x.items() if isinstance(x, dict) else [("", x)] for x in vars(mechanism).values()]
    return [(name, id(one)) for items in inside for name, one in items]


def _room(packed: Packed, W: Work) -> tuple[Step, Work, Array]:
    """A step memory and the work beside it, whose numbers to come back to are one array, it too."""
    q, n, m = packed.q.size, packed.v.size, packed.system.rows.kind.size
    sizes = {"q": q, "v": n, "a": n, "vd": n, "lam": m, "q1": q, "v1": n, "vd1": n, "lam1": m}
    sizes |= {"psi": n, "work": 3, "lost": 3, "size": 6, "method": 5, "bdf": 3, "past": 2 * n}
    sizes |= {"drift": n, "count": 12, "base": W.base.size}
    flat = np.zeros(sum(sizes.values()))
    pieces = dict(zip(sizes, np.split(flat, np.cumsum(list(sizes.values()))[:-1]), strict=True))
    W = W.replace(base=pieces.pop("base"))
    past, count = pieces.pop("past").reshape(2, 1, n), pieces.pop("count").view(np.int64)
    return Step(past=past, count=count, **pieces), W, flat
