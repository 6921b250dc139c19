"""Laws that are asked once a sample: which steps end there, and what their jump does to a step.

A force that jumps behind an instant lets accelerations, multipliers and what a method remembers of
them jump; else an implicit method sees it half a step late.
"""

from dataclasses import replace

import numpy as np

from rom.errors import ConfigError
from rom.mbs.elements.family import Laws, Sampled
from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.packing import Packed
from rom.mbs.integrate.events import Instant
from rom.mbs.integrate.run import Record, Settings
from rom.mbs.integrate.step_memory import accelerated, begin, recall, state_of
from rom.mbs.kernels.work import Step, Work
from rom.mbs.results.state import State

SAME_TIME = 1e-6  # of a step, that numbers of times may miss each other by


def check_samples(packed: Packed, settings: Settings) -> None:
    """Refuse steps that do not end on the samples."""
    for law in samples_of(packed):
        if settings.dt is None or settings.method == "dop853" or settings.order != 2:
            text = f"the law of {law.name!r} is sampled, which needs implicit steps of one length"
            raise ConfigError(f"{text}, of order two.", hint="Give dt, and leave out the rest.")
        _whole(law, law.every, settings.h)


def samples_of(packed: Packed) -> list[Sampled]:
    """The laws that are sampled."""
    return [law for law in packed.asked if isinstance(law, Sampled)]


def _whole(law: Sampled, time: float, h: float) -> int:
    """Number of steps in a time; refused if it is no multiple of them."""
    n = round(time / h)
    if abs(n * h - time) > SAME_TIME * h or n < 1:
        text = f"the next sample of {law.name!r} comes after {time:.9g} s, no multiple of the step"
        hint = "Take a dt that goes into every, and a t_end that is a multiple of it."
        raise ConfigError(f"{text} of {h:.9g} s.", hint=hint)
    return n


def begin_sampled(record: Record, W: Work, state: State, forces: Laws) -> tuple[Step, State]:
    """Step memory at the start of a run, see `begin`, behind the samples that are due there."""
    step, start = begin(record, W, state, forces, record.settings.h)
    if start.memory is not None or not _due(record, W, start.t):
        return step, start
    _sample(record, W, start)
    start = replace(start, base=W.base.copy(), algorithmic=None)
    return begin(record, W, start, forces, record.settings.h)


def steps_up_to_sample(record: Record, W: Work, step: Step, forces: Laws, most: int) -> int:
    """Take the samples that are due; number of steps up to the next ones, or the most there are."""
    if _due(record, W, record.t):
        _jump(record, W, step, forces)
    laws, t, h = samples_of(record.packed), record.t, record.settings.h
    return min([most, *(_whole(law, law.memory(W)[0] - t, h) for law in laws)])


def _due(record: Record, W: Work, t: float) -> list[Sampled]:
    """The laws to be asked at a time."""
    late = t + SAME_TIME * record.settings.h
    return [law for law in samples_of(record.packed) if law.memory(W)[0] <= late]


def _sample(record: Record, W: Work, state: State) -> None:
    """Ask the laws that are due at a state, in which W is evaluated."""
    W.base[:] = W.base if state.base is None else state.base
    evaluate(record.packed.system, W, state.q, state.v)
    due = _due(record, W, state.t)
    for fmu in record.mechanism.fmus.values():
        for law in [law for law in due if law.name in fmu.targets][:1]:
            record.seen = seen = record.seen or Instant(record.mechanism, record.packed)
            seen.set(state.t, state.q, state.v)
            seen.W.base[:], seen.lam = W.base, state.lam
            fmu.ask(seen, law.memory(W)[0])
    for law in due:
        law.sample(W, state.t)


def _jump(record: Record, W: Work, step: Step, forces: Laws) -> None:
    """Take samples where a step has ended, and let all that depends on the forces jump."""
    state, rest = record.final, np.zeros_like(step.v)
    W.base[:] = state.base
    before = accelerated(record, W, state, forces, 0.0, rest)
    _sample(record, W, state)
    base = W.base.copy()
    after = accelerated(record, W, state, forces, 0.0, rest)
    W.base[:] = base
    recall(state.memory, W, step)  # of the factor, in whose place these were solved
    a, h = after.a - before.a, record.settings.h
    step.vd[:] += a
    step.lam[:] += after.lam - before.lam
    step.lost[:] = W.power
    if record.settings.method == "bdf":  # the step before as it would have led here
        step.a[:] -= h * a
        step.psi[:] -= h**2 / 2 * a
    else:
        step.a[:] += a
    record.reach(state_of(record, W, step))
