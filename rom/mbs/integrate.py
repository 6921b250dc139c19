"""Simulate a mechanism in time."""

import sys
from time import perf_counter
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.errors import ConfigError, InterruptedRun, RomError
from rom.mbs.alpha import advance
from rom.mbs.arrays import workspace
from rom.mbs.compiled import compiled_before
from rom.mbs.events import watch_of
from rom.mbs.explicit import run_explicit
from rom.mbs.implicit import run_implicit
from rom.mbs.mechanism import Mechanism
from rom.mbs.packing import Packed, pack
from rom.mbs.record import Record, Settings
from rom.mbs.solution import Solution
from rom.mbs.state import State, initial_state
from rom.mbs.validity import warn_of_limits
from rom.mbs.variable import run_variable

METHODS = {"generalized-alpha": run_implicit, "bdf": run_implicit, "dop853": run_explicit}
# tolerance of variable steps, of the explicit method and of implicit ones
RTOL = {"dop853": 1e-12, "bdf": 1e-4, "generalized-alpha": 1e-4}


@typed
def simulate(  # noqa: PLR0913  keywords of the one entry, most have defaults
    mechanism: Mechanism,
    *,
    t_end: float,
    dt: float | None = None,
    method: str = "generalized-alpha",
    rho_inf: float = 0.9,
    tolerance: float = 1e-9,
    rtol: float | None = None,
    atol: float = 1e-12,
    progress: bool = False,
    save_every: int = 1,
    t_start: float | None = None,
    state: State | None = None,
    order: int = 2,
    stabilised: bool = False,
) -> Solution:
    """Move the mechanism from the start to ``t_end``.

    Args:
        mechanism: bodies, joints, forces.
        t_end: end time [s].
        dt: time step of an implicit method, output interval of dop853 [s]; shortened a little if
            the duration is not a multiple of it. None lets an implicit method choose its steps by
            ``rtol``; ask the solution for times in between by ``solution.at``.
        method: "generalized-alpha" (implicit, second order, for everything), "bdf" (implicit,
            second order or as ``order`` says, damps all that the step does not resolve), or
            "dop853" (explicit, eighth order, variable step: references for smooth, not too stiff
            motion).
        rho_inf: spectral radius of generalised-alpha at infinite frequency: 1 keeps energy, but
            reactions then collect round-off over many steps; 0 removes what the time step does
            not resolve in one step.
        tolerance: of the Newton iteration, relative to what the accelerations move in one step.
        rtol: relative tolerance of variable steps. dop853 keeps it in every step (1e-12);
            implicit methods let the errors of all steps add up to it (1e-4), lengths relative to
            the size of the mechanism, velocities to the largest so far, weighted by mass.
        atol: absolute tolerance of dop853.
        progress: report on stderr.
        save_every: keep every so many steps.
        t_start: start time [s]; None for 0, or for the time of ``state``.
        state: state of an earlier run of the same mechanism to go on from, e.g. ``sol.final``.
            Generalised-alpha with the same dt then gives the same bits as a run without a stop.
        order: of bdf, 1 to 5, with steps dt. Above two, vibrations of little damping that the
            step resolves poorly can grow. Its first ``order - 1`` steps are Radau's.
        stabilised: let an implicit method keep the constraints of the velocities to round-off,
            which it else leaves to its truncation error: multipliers of their own close the gaps
            of the positions (index 2, after Gear, Gupta and Leimkuhler). BDF of an order other
            than two always does.

    Returns:
        The motion, start and end included.

    Raises:
        ConfigError: for a wrong argument.
        ModelError: if joints contradict each other.
        SolverError: naming time and culprit; ``error.solution`` holds the motion up to there, None
            if it never started.
        InterruptedRun: after Ctrl-C; ``error.solution`` holds the motion up to there.

    Warns:
        RomWarning: if a body left the range of small elastic deformation, or turned faster than
            it can without geometric stiffness.
    """
    if not isinstance(mechanism, Mechanism):
        raise ConfigError(f"{mechanism!r} is no Mechanism.")
    if not isinstance(method, str) or method not in METHODS:
        raise ConfigError(f"no method {method!r}; there are {sorted(METHODS)}.")
    if t_start is None:
        t_start = 0.0 if state is None else state.t
    rtol = RTOL[method] if rtol is None else rtol
    numbers = (t_start, t_end, dt, save_every, rho_inf, tolerance, rtol, atol)
    settings = Settings(*numbers, progress, method, order=order, stabilised=stabilised)
    settings = settings.after(None if state is None else state.memory)
    packed = pack(mechanism)
    if progress and not compiled_before(advance):
        sys.stderr.write("compile the integrator, once on this machine: one or two minutes\n")
    W = workspace(packed.system, len(packed.signals))
    record = Record(mechanism, packed, settings, perf_counter())
    status = f"Reached t = {t_end:g} s."
    try:
        if state is None:
            state = initial_state(packed, t_start, settings.spacing)
        _check_fit(state, packed)
        if packed.by_blocks and state.rank < state.lam.size:
            record.packed = packed = packed.whole()
            W = workspace(packed.system, len(packed.signals))
        record.watch = watch_of(mechanism, packed, t_start)
        run = run_variable if dt is None else METHODS[method]
        run(record, W, state)
    except RomError as error:
        error.solution = record.solution(f"Stopped: {error}") if record.blocks else None
        if record.blocks:
            warn_of_limits(error.solution)
        raise
    except KeyboardInterrupt:
        interrupted = InterruptedRun(
            f"interrupted at t = {record.t:.6g} s of {t_end:g} s.",
            hint="The motion up to there is kept in error.solution.",
        )
        interrupted.solution = record.solution(str(interrupted)) if record.blocks else None
        raise interrupted from None
    stopped = "" if record.watch is None else record.watch.sentence
    solution = record.solution(stopped or status)
    warn_of_limits(solution)
    return solution


def _check_fit(state: Any, packed: Packed) -> None:
    """Compiled code does not look at the size of its arrays, so this is the place to do it."""
    followed = packed.system.coordinates.kind.size
    base = np.zeros(followed) if state.base is None else state.base
    q, v, lam, angles = (np.size(x) for x in (state.q, state.v, state.lam, base))
    needed = (packed.q.size, packed.v.size, packed.system.rows.kind.size, followed)
    if (q, v, lam, angles) != needed:
        raise ConfigError(
            f"the state has {q} coordinates and {v} velocities, {lam} constraints and {angles} "
            "followed joint coordinates; this mechanism has {}, {}, {} and {}.".format(*needed)
        )
