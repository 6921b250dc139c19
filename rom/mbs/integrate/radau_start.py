"""The first instants of a multistep method: Radau IIA on the accelerations.

A formula of order k needs k instants before it may step. Radau finds them to far more digits than
the steps will keep, stiff bodies included.
"""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from rom import rotation
from rom.errors import ConfigError, SolverError
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate.consistent_start import assembled, fitting_velocity
from rom.mbs.integrate.dop853 import Equations
from rom.mbs.integrate.generalized_alpha import Step
from rom.mbs.integrate.run import Record
from rom.mbs.kernels.work import Work
from rom.mbs.results.state import State
from rom.model import Array

RADAU_RTOL, RADAU_ATOL = 1e-11, 1e-13


def first_steps(record: Record, W: Work, step: Step) -> tuple[Array, tuple[Array, ...]]:
    """Take the steps before the formula can begin, and give T its past.

    Returns:
        Their times and rows of q, v, vd, lam, work and base.

    Raises:
        ConfigError: if the run has fewer steps.
        SolverError: if the equations of motion are singular there.
    """
    start, count = record.final, step.past.shape[1]
    if count > record.settings.steps:
        raise ConfigError(
            f"bdf of order {count + 1} needs {count} steps to begin with, the run has "
            f"{record.settings.steps}.",
            hint="Take shorter steps or a lower order.",
        )
    t = record.settings.time(np.arange(count + 1))
    equations = Equations(record, W, start)
    W.base[:] = start.base
    first = _instant(record, equations, t[0], np.concatenate([start.q, start.v, np.zeros(3)]))
    states, works = [first[0]], [first[1]]
    if count:
        y = np.concatenate([first[0].q, first[0].v, np.zeros(3)])
        options = {"method": "Radau", "rtol": RADAU_RTOL, "atol": RADAU_ATOL, "t_eval": t[1:]}
        found: Any = solve_ivp(equations, (t[0], t[-1]), y, **options)
        if not found.success:
            raise SolverError(
                f"the first steps failed after t = {t[0]:.9g} s: {found.message}",
                hint="Take bdf of order two, or generalized-alpha.",
            )
        for x, y in zip(t[1:], found.y.T, strict=True):
            state, work = _instant(record, equations, float(x), y)
            states.append(state)
            works.append(work)
    _remember(record, W, step, states, works[-1])
    rows = [[getattr(x, name) for x in states[1:]] for name in ("q", "v", "a", "lam")]
    rows += [works[1:], [x.base for x in states[1:]]]
    return t[1:], tuple(np.array(x) for x in rows)


def _instant(record: Record, equations: Equations, t: float, y: Array) -> tuple[State, Array]:
    """The state that fits the constraints at a time, and the works up to there."""
    packed, n_q, n = record.packed, equations.n_q, equations.n
    for at in packed.system.bodies.q_at:
        y[at + 3 : at + 7] /= np.linalg.norm(y[at + 3 : at + 7])
    equations(t, y)
    q = assembled(packed, equations.W, y[:n_q])
    v = fitting_velocity(packed, equations.W, q, y[n_q : n_q + n])
    y = np.concatenate([q, v, y[-3:]])
    equations(t, y, accepted=True)
    a, lam, base = equations.a.copy(), equations.lam.copy(), equations.W.base.copy()
    return State(t, q, v, a, lam, equations.rank, None, base), y[-3:].copy()


def _remember(record: Record, W: Work, step: Step, states: list[State], work: Array) -> None:
    """Let T stand at the last state and know the ones before it."""
    now = states[-1]
    for name, x in (("q", now.q), ("v", now.v), ("vd", now.a), ("lam", now.lam), ("work", work)):
        getattr(step, name)[:] = x
    step.lost[:] = W.power
    step.count[alpha.STEPS] = len(states) - 1
    for j, state in enumerate(states[-2::-1]):
        step.past[0, j], step.past[1, j] = _seen(record, now.q, state.q), state.v


def _seen(record: Record, q: Array, other: Array) -> Array:
    """(n,) increment that leads from coordinates q to other ones."""
    bodies: Any = record.packed.system.bodies
    out = np.zeros(record.packed.v.size)
    for at, vt, r in zip(bodies.q_at, bodies.v_at, bodies.r, strict=True):
        back = q[at + 3 : at + 7] * np.array([1.0, -1.0, -1.0, -1.0])
        out[vt : vt + 3] = other[at : at + 3] - q[at : at + 3]
        out[vt + 3 : vt + 6] = rotation.log(rotation.multiply(back, other[at + 3 : at + 7]))
        out[vt + 6 : vt + 6 + r] = other[at + 7 : at + 7 + r] - q[at + 7 : at + 7 + r]
    return out
