"""The end of a run by an event."""

from dataclasses import replace
from typing import Any

import numpy as np

from rom.errors import RomError
from rom.mbs.elements.family import Laws
from rom.mbs.integrate.consistent_start import assembled, fitting_velocity
from rom.mbs.integrate.run import Record
from rom.mbs.integrate.step_memory import accelerated, signals_at
from rom.mbs.kernels.work import Work
from rom.mbs.results.interpolation import Point, between
from rom.mbs.results.state import State
from rom.model import Array


def kept_before_the_end(
    record: Record,
    W: Work,
    forces: Laws,
    t: Array,
    out: tuple[Array, ...],
    saved: Array,
) -> bool:
    """Look for events in some steps; True, and all that counts kept, if one ends the run.

    Args:
        record: of the run; its last state is where the steps began.
        W: working memory.
        forces: laws in Python.
        t: (k,) times of the steps.
        out: their q, v, a, lam, work and base, one row each.
        saved: (k,) steps to be kept.

    Raises:
        RomError, KeyboardInterrupt: of an event function; what came before is kept.
    """
    first = _row(record)
    k, failure = _look(record, first, t, out)
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
    _finish(record, W, forces, state, ends, (last[5], out[4][k]))
    return True


def _row(record: Record) -> tuple[Any, ...]:
    """Time, q, v, a, lam, work and base of the last state; work is that of the last kept row."""
    f = record.final
    return record.t, f.q, f.v, f.a, f.lam, record.blocks[-1][5][-1], f.base


def projected(record: Record, W: Work, ends: tuple[Point, Point], t: float) -> tuple[Array, Array]:
    """Coordinates and velocities between two instants that satisfy the constraints."""
    packed = record.packed
    q, v, _ = between(packed.system, *ends, t)
    signals_at(record, W, t)
    q = assembled(packed, W, q)
    return q, fitting_velocity(packed, W, q, v)


def _look(
    record: Record, first: tuple[Any, ...], t: Array, out: tuple[Array, ...]
) -> tuple[int, BaseException | None]:
    """Number of steps before the one that an event ends, or that an event function refuses."""
    # not the memory of the steps: its factorisation must stay
    left, base, W = Point(*first[:4]), first[6], record.watch.instant.W
    for k in range(t.size):
        right = Point(t[k], *(x[k] for x in out[:3]))

        def motion(x: float, left: Point = left, right: Point = right) -> tuple[Array, Array]:
            if x == right.t:
                return right.q, right.v
            return between(record.packed.system, left, right, x)[:2]

        def exact(x: float, ends: tuple[Point, Point] = (left, right)) -> tuple[Array, Array]:
            return projected(record, W, ends, x)

        W.base[:] = base
        try:
            if record.watch.step(left.t, right.t, motion, exact):
                return k, None
        except (RomError, KeyboardInterrupt) as failure:
            return k, failure
        left, base = right, out[5][k]
    return t.size, None


def _finish(
    record: Record,
    W: Work,
    forces: Laws,
    state: State,
    ends: tuple[Point, Point],
    works: tuple[Array, Array],
) -> None:
    """Keep the instant of the event: in between, corrected to satisfy the constraints."""
    left, right = ends
    t = record.stopped
    W.base[:] = state.base
    q, v = projected(record, W, ends, t)
    state = replace(state, t=t, q=q, v=v)
    record.t, record.final = t, accelerated(record, W, state, forces, 0.0, np.zeros_like(v))
    share = (t - left.t) / (right.t - left.t)
    work = works[0] + share * (works[1] - works[0])
    record.keep_state(record.final, work)
