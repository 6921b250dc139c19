"""Implicit methods with steps of one length: compiled steps in chunks, or around Python forces."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from rom.errors import RomError, SolverError
from rom.mbs.elements.family import Laws, apply_laws
from rom.mbs.equations.equations import evaluate, residual
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate.consistent_start import assembled, fitting_velocity
from rom.mbs.integrate.dop853 import first_steps
from rom.mbs.integrate.events import Noted
from rom.mbs.integrate.run import Record, standing_at
from rom.mbs.integrate.sampling import begin_sampled, steps_up_to_sample
from rom.mbs.integrate.step_memory import RUN_COUNTS, accelerated, recall, signals_at, state_of
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.system import ANGLE
from rom.mbs.kernels.work import Step, Work
from rom.mbs.parts.signals import padded, sampled
from rom.mbs.results.interpolation import Point, between
from rom.mbs.results.state import State
from rom.model import Array

# seconds between looks at the keyboard and the progress line; steps between them, at first and most
CHUNK_SECONDS, FIRST_CHUNK, LARGEST_CHUNK = 0.2, 16, 4096
# change of a law by the last correction, of its size, that keeps a step from ending
RESTLESS_LAW_RTOL = 1e-2
Instant = tuple[Array, ...]  # q, v, a, lam, work and base
Ends = tuple[Point, Point]  # of a step
Chunk = tuple[Array, Array, Instant]  # times, signals, and room for what is kept
LOSING_SHARE = 0.9  # of half a turn a step, from where on one that gains speed may exceed it


def run_implicit(record: Record, W: Work, state: State) -> None:
    """Fill the record by generalised-alpha or BDF with steps of one length."""
    forces, settings = record.packed.asked, record.settings
    step, state = begin_sampled(record, W, state, forces)
    alpha.advance.link()
    record.start(state, step.work)
    record.clock = perf_counter()
    done, n = settings.begun, settings.steps
    if step.bdf.size != 3 and not step.count[entry.HAS_FACTOR]:
        with standing_at(record, record.given):
            done = _first(record, W, step, forces)

    def take(most: int) -> int:
        nonlocal done
        ahead = steps_up_to_sample(record, W, step, forces, min(most, n - done))
        taken = _chunk(record, W, step, forces, done, ahead)
        done += taken
        return taken

    in_chunks(record, take, lambda: done < n)
    if n % settings.save_every and not record.stopped:
        record.keep(record.t, *(x[None].copy() for x in _saved(W, step)))


def in_chunks(record: Record, take: Callable[[int], int], goes_on: Callable[[], bool]) -> None:
    """Take steps, up to so many at once as `CHUNK_SECONDS` has time for, until the run ends."""
    most = FIRST_CHUNK
    while goes_on() and not record.stopped:
        clock = perf_counter()
        taken = take(most)
        spent = max(perf_counter() - clock, 1e-6)
        most = int(np.clip(CHUNK_SECONDS / spent * taken, 1, LARGEST_CHUNK))
        record.pause()


def _first(record: Record, W: Work, step: Step, forces: Laws) -> int:
    """Take the steps before a multistep method can begin; returns how many there were."""
    t, rows = first_steps(record, W, step)
    step.count[entry.STEPS_BEFORE] = 0
    if not record.watch:
        every = record.settings.save_every
        rows = tuple(x[every - 1 :: every] for x in rows)
    _note(record, W, step, forces, t, rows)
    return t.size


def _saved(W: Work, step: Step) -> tuple[Array, ...]:
    """What is kept of an instant: q, v, vd, lam, work and base."""
    return step.q, step.v, step.vd, step.lam, step.work, W.base


def space(W: Work, step: Step, rows: int) -> tuple[Array, ...]:
    """Arrays for what is kept of so many instants."""
    return tuple(np.zeros((rows, x.size)) for x in _saved(W, step))


def _chunk(record: Record, W: Work, step: Step, forces: Laws, done: int, count: int) -> int:
    """Take up to ``count`` steps and keep what is to be saved; returns how many were taken."""
    packed, settings = record.packed, record.settings
    t = settings.time(np.arange(done + 1, done + count + 1))
    table, failure = sampled(packed.signals, padded(t), settings.span, settings.spacing, settings.h)
    good = min(len(table), count)
    every = 1 if record.watch else settings.save_every
    out = space(W, step, (done + good) // every - done // every)
    step.count[entry.STEPS_BEFORE] = before = step.count[entry.STEPS]
    mark = Mark(Step(*(x.copy() for _, x in step.items())), record.final, record.noted)
    try:
        try:
            answer = advance(record, W, step, forces, (t, table[:good], out))
        finally:
            taken = int(step.count[entry.STEPS] - before)
            _note(record, W, step, forces, t[:taken], out)
        if record.stopped:
            return taken
        if answer != alpha.CONVERGED:
            raise failed_step(record, W, step, answer, t[taken])
    except BaseException:
        _retrace(record, W, mark, forces, (t, table[:good], out))
        raise
    if failure is not None and good < count:
        raise failure
    return taken


class Mark(NamedTuple):
    """Where a chunk began: step memory, state and events there."""

    T: Step
    state: State
    noted: Noted | None


def _retrace(record: Record, W: Work, mark: Mark, forces: Laws, chunk: Chunk) -> None:
    """Repeat the good steps of a chunk that failed, to stand behind the last as if it ended there.

    The step that failed has changed the factorisation and more of what the next one starts from.
    Laws that answer differently the second time leave the run where the chunk began.
    """
    times, table, out = chunk
    k, step, begin = int(np.searchsorted(times, record.t, side="right")), mark.T, mark.state
    noted = record.watch.noted() if record.watch else None
    record.reach(record.given if begin.memory is None else begin, mark.noted)
    if not k:
        return
    W.base[:] = begin.base
    if begin.memory is not None:
        recall(begin.memory, W, step)
    try:
        spare = tuple(np.empty_like(x) for x in out)
        answer = advance(record, W, step, forces, (times, table[:k], spare))
    except (RomError, KeyboardInterrupt):
        return
    if answer == alpha.CONVERGED:
        record.counts = counts(step)
        record.reach(state_of(record, W, step), noted)


def advance(record: Record, W: Work, step: Step, forces: Laws, chunk: Chunk) -> int:
    """Run a chunk, calling Python forces whenever they are asked for; says how it ended."""
    times, table, out = chunk
    settings, system = record.settings, record.packed.system
    rank = record.packed.rows_solved(record.final.rank)
    answer = alpha.NEEDS_LAWS
    while answer == alpha.NEEDS_LAWS:
        clock = perf_counter()
        every = 1 if record.watch else int(settings.save_every)
        answer = alpha.advance(system, W, step, rank, table, every, out)
        record.compiled += perf_counter() - clock
        if answer == alpha.NEEDS_LAWS:
            t = times[step.count[entry.STEPS] - step.count[entry.STEPS_BEFORE]]
            apply_laws(forces, W, float(t), slopes=not step.count[entry.HAS_FACTOR])
    return answer


def counts(step: Step) -> dict[str, float]:
    """Steps, Newton iterations and factorisations so far."""
    names = ("steps", "iterations", "factorisations")
    return dict(zip(names, step.count[list(RUN_COUNTS)].tolist(), strict=True))


def _note(record: Record, W: Work, step: Step, forces: Laws, t: Array, out: Instant) -> None:
    """Keep the saved steps of a chunk, finished or not."""
    record.counts = counts(step)
    done = int(step.count[entry.STEPS_BEFORE])
    saved = np.arange(done + 1, done + t.size + 1) % record.settings.save_every == 0
    if record.watch and kept_before_the_end(record, W, forces, t, out, saved):
        return
    if saved.any():
        chosen = saved if record.watch else slice(saved.sum())
        record.keep(t[saved], *(x[: t.size][chosen] for x in out))
    if t.size:
        record.t = float(t[-1])
    record.reach(state_of(record, W, step))


def failed_step(record: Record, W: Work, step: Step, answer: int, t: float) -> SolverError:
    """The error that says why a step did not succeed."""
    what = {
        alpha.FAILED: f"Newton did not converge in {step.count[entry.STEP_PASSES]} corrections",
        alpha.NOT_FINITE: "the motion is no longer finite",
        alpha.SINGULAR: "the iteration matrix is singular",
    }[int(answer)]
    culprit = ""
    if W.value.size and np.isfinite(W.value).any():
        k = int(np.nanargmax(np.abs(W.value)))
        culprit = f"; the largest gap is {abs(W.value[k]):.3g} in {record.packed.row_owner[k]!r}"
    culprit += record.packed.broken_laws
    culprit += _restless_law(record, W, step, t) if answer == alpha.FAILED else ""
    cure = (
        f"Take a smaller step than {step.method[0]:.3g} s; if that does not help, the "
        "mechanism is near a singular position or a force is too stiff."
    )
    return SolverError(
        f"{what} at t = {t:.9g} s (last increment {step.size[0]:.3g} of the size){culprit}.",
        hint=f"{_lost_turn(record, W, float(step.method[0])) or cure} The motion up to there is "
        "kept in error.solution.",
    )


def _restless_law(record: Record, W: Work, step: Step, t: float) -> str:
    """Names the law that the last correction changed most, if that is much; empty otherwise."""
    packed = record.packed
    before = packed.answers()
    evaluate(packed.system, W, step.q1, step.v1)
    apply_laws(packed.asked, W, t)
    residual(packed.system, W, step.q1, step.v1, step.vd1, step.lam1)
    changes = {
        name: np.abs(now - before[name]).max() / np.abs([now, before[name]]).max()
        for name, now in packed.answers().items()
        if now.any()
    }
    name = max(changes, key=lambda name: changes[name], default="")
    if not name or not changes[name] > RESTLESS_LAW_RTOL:
        return ""
    return f"; the law of {name!r} still changes by {changes[name]:.2g} of itself"


def _lost_turn(record: Record, W: Work, h: float) -> str:
    """Says which joint turns so fast that a step of h loses its turns; empty if none does."""
    packed, state = record.packed, record.final or record.given
    C, body = packed.system.coordinates, packed.system.markers.body
    if not C.kind.size or state is None:
        return ""
    evaluate(packed.system, W, state.q, state.v)
    turns = np.where(C.kind == ANGLE, np.abs(W.xd) * h, 0.0)
    k = int(turns.argmax())
    if turns[k] < LOSING_SHARE * np.pi:
        return ""
    one, other = (packed.names[b] if b >= 0 else "ground" for b in (body[C.i[k]], body[C.j[k]]))
    return (
        f"Body {other!r} turns by {turns[k]:.3g} rad a step against {one!r}, and the angle of "
        "their joint, with the gear or spring that acts on it, loses turns from pi on: take steps "
        f"below {np.pi * h / turns[k]:.3g} s."
    )


def kept_before_the_end(
    record: Record, W: Work, forces: Laws, t: Array, out: tuple[Array, ...], saved: Array
) -> bool:
    """Look for events in some steps; True, and all that counts kept, if one ends the run.

    Steps go on from the last state of the record to times t (k,), with one row each of q, v, a,
    lam, work and base; saved (k,) says which are kept. What came before an event function that
    fails is kept, too.
    """
    f = record.final
    first = record.t, f.q, f.v, f.a, f.lam, record.blocks[-1][5][-1], f.base
    k, failure = _look(record, Point(*first[:4]), f.base, t, out)
    if k == t.size:
        return False
    rows = (t[:k], *(x[:k] for x in out))
    if saved[:k].any():
        record.keep(*(x[saved[:k]] for x in rows))
    last = tuple(x[-1] for x in rows) if k else first
    now, q, v, a, lam, _, base = last
    state = State(now, q, v, a, lam, record.final.rank, None, base)
    if failure:
        record.t, record.final = state.t, state
        raise failure
    ends = Point(*last[:4]), Point(t[k], *(x[k] for x in out[:3]))
    record.counts["steps"] -= t.size - 1 - k  # those taken behind the end depend on the clock
    _finish(record, W, forces, state, ends, (last[5], out[4][k]))
    return True


def _projected(record: Record, W: Work, ends: Ends, t: float) -> tuple[Array, Array]:
    """Coordinates and velocities between two instants that satisfy the constraints."""
    packed = record.packed
    q, v, _ = between(packed.system, *ends, t)
    signals_at(record, W, t)
    q = assembled(packed, W, q)
    return q, fitting_velocity(packed, W, q, v)


def _look(
    record: Record, left: Point, base: Array, t: Array, out: Instant
) -> tuple[int, BaseException | None]:
    """Number of steps before the one that an event ends, or that an event function refuses."""
    # not the memory of the steps: its factorisation must stay
    W = record.watch.instant.W
    for k in range(t.size):
        right = Point(t[k], *(x[k] for x in out[:3]))

        def motion(x: float, left: Point = left, right: Point = right) -> tuple[Array, Array]:
            if x == right.t:
                return right.q, right.v
            return between(record.packed.system, left, right, x)[:2]

        def exact(x: float, ends: Ends = (left, right)) -> tuple[Array, Array]:
            return _projected(record, W, ends, x)

        W.base[:] = base
        try:
            if record.watch.step(left.t, right.t, motion, exact):
                return k, None
        except (RomError, KeyboardInterrupt) as failure:
            return k, failure
        left, base = right, out[5][k]
    return t.size, None


def _finish(
    record: Record, W: Work, forces: Laws, state: State, ends: Ends, works: tuple[Array, Array]
) -> None:
    """Keep the instant of the event: in between, corrected to satisfy the constraints."""
    (left, right), t = ends, record.stopped
    W.base[:] = state.base
    q, v = _projected(record, W, ends, t)
    state = replace(state, t=t, q=q, v=v)
    record.t, record.final = t, accelerated(record, W, state, forces, 0.0, np.zeros_like(v))
    share = (t - left.t) / (right.t - left.t)
    record.keep_state(record.final, works[0] + share * (works[1] - works[0]))
