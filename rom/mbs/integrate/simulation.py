"""Simulate a mechanism in time; go on with the same bodies under other joints, drives or forces."""

from contextlib import suppress
from dataclasses import replace
from time import perf_counter
from typing import Annotated, Any, Literal

import numpy as np

from rom.arguments import Between, Count, Number, Positive, Share, typed
from rom.errors import ConfigError, InterruptedRun, ResourceError, RomError, RomWarning
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.integrate.adaptive_step import run_variable
from rom.mbs.integrate.bdf import LARGEST_ORDER
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.integrate.dop853 import run_explicit
from rom.mbs.integrate.events import Instant, Watch
from rom.mbs.integrate.fixed_step import run_implicit
from rom.mbs.integrate.keeping import Keeping, digests_of
from rom.mbs.integrate.run import Record, Settings
from rom.mbs.integrate.sampling import check_samples
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.audit import warn_of_failures, warn_of_limits
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State, check_state
from rom.process.interruption import terminable

METHODS = {"generalized-alpha": run_implicit, "bdf": run_implicit, "dop853": run_explicit}
# tolerance of variable steps, of the explicit method and of implicit ones
TOLERANCES = (1e-14, 1e-2)  # of the Newton iteration: round-off, and no solution at all
METHOD_RTOL = {"dop853": 1e-12, "bdf": 1e-4, "generalized-alpha": 1e-4}


@typed
def simulate(  # noqa: PLR0913  keywords of the one entry, most have defaults
    mechanism: Mechanism,
    *,
    t_end: Annotated[float, Number("s")],
    dt: Annotated[float, Positive("s")] | None = None,
    method: Literal["generalized-alpha", "bdf", "dop853"] = "generalized-alpha",
    rho_inf: Share = 0.9,
    tolerance: Annotated[float, Between(*TOLERANCES)] = 1e-9,
    rtol: Annotated[float, Positive()] | None = None,
    atol: Annotated[float, Positive()] = 1e-12,
    progress: bool = False,
    save_every: Annotated[int, Count(1)] = 1,
    t_start: Annotated[float, Number("s")] | None = None,
    state: State | None = None,
    order: Annotated[int, Count(1, LARGEST_ORDER)] = 2,
    stabilised: bool = False,
    keep: Keeping | None = None,
    assemble: bool = False,
) -> Solution:
    """Move the mechanism from the start to ``t_end``.

    Args:
        mechanism: bodies, joints, forces.
        t_end: end time [s].
        dt: time step of an implicit method, output interval of dop853 [s]; shortened a little if
            the duration is not a multiple of it. None keeps steps that are chosen by ``rtol``; ask
            the solution for times in between by ``solution.at``, to fourth order in the step:
            those of dop853 are long.
        method: "generalized-alpha" (implicit, second order, for everything), "bdf" (implicit,
            second order or as ``order`` says, damps all that the step does not resolve), or
            "dop853" (explicit, eighth order, variable step: references for smooth, not too stiff
            motion).
        rho_inf: spectral radius of generalised-alpha at infinite frequency [1]: 1 keeps energy, but
            reactions then collect round-off over many steps; 0 removes what the time step does
            not resolve in one step.
        tolerance: of the Newton iteration [1], relative to what the accelerations move in one step.
        rtol: relative tolerance of variable steps [1]. dop853 keeps it in every step (1e-12);
            implicit methods let the errors of places in all steps add up to it (1e-4), relative to
            the size of the mechanism and weighted by mass. Vibrations too small to matter for it
            are not followed; who asks for them, for velocities or loads, asks for less.
        atol: absolute tolerance of dop853, of positions and velocities [m, rad, m/s, rad/s].
        progress: report on stderr.
        save_every: keep every so many steps.
        t_start: start time [s]; None for 0, or for the time of ``state``.
        state: state of an earlier run of the same mechanism to go on from, e.g. ``sol.final``.
            The same method then gives the same bits as a run without a stop, unless it needs
            derivatives of drives that have none; ``keep`` gives them always.
        order: of bdf, 1 to 5, with steps dt. Above two, vibrations of little damping that the
            step resolves poorly can grow. Its first ``order - 1`` steps are Radau's.
        stabilised: let an implicit method keep the constraints of the velocities to round-off,
            which it else leaves to its truncation error: multipliers of their own close the gaps
            of the positions (index 2, after Gear, Gupta and Leimkuhler). BDF of an order other
            than two always does.
        keep: folder in which the motion is kept while it is computed, every second or so, and
            from which a run that was ended by anything goes on to the same bits:
            ``keep=rom.Keeping("run.parts")``, then ``rom.Keeping("run.parts", resume=True)``. With
            ``t_end`` before the time reached this reads the motion without moving on.
        assemble: move the start as far as joints and drives ask for it, without a word. Else
            gaps and strains from 1e-6 of the size of the mechanism (or in rad), and changes of
            velocities from 1e-6 of the largest one given, are told, and from 1e-2 refused. Bodies
            that were given no velocity take that of their joints and drives without a word.
            ``statistics["closed"]`` is the largest change.

    Returns:
        The motion, start and end included.

    Raises:
        ConfigError: for a wrong argument, or a function that takes or gives the wrong thing.
        ModelError: if joints contradict each other, or what was given at the start.
        SolverError: naming time and culprit, a function of the user too, whatever it raised.
        ResourceError: if what would be kept exceeds the memory, or the memory ran out.
        InterruptedRun: after Ctrl-C or SIGTERM; the caller decides what then. This and every
            other error that ends a motion has ``error.solution``: the motion up to there, None if
            it never started. ``error.solution.final`` is the state to go on from.

    Warns:
        RomWarning: if joints or drives moved the start, a body left the range of small elastic
            deformation, or turned faster than it can without geometric stiffness; or if balances,
            joints or steps of the motion do not pass `rom.audit`.

    Source:
        Bruels, Cardona and Arnold, Lie group generalized-alpha time integration of constrained
        flexible multibody systems, Mech. Mach. Theory 48 (2012) 121, see
        docs/theory/floating_frame.md; Hairer and Wanner, Solving Ordinary Differential
        Equations II, for BDF.

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
        >>> ball = mech.add_rigid("ball", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0))
        >>> sol = rom.simulate(mech, t_end=1.0, dt=1e-2)
        >>> round(float(sol.position("ball")[-1, 2]), 6)  # - g t^2 / 2
        -4.905
    """
    if t_start is None:
        t_start = 0.0 if state is None else state.t
    rtol = METHOD_RTOL[method] if rtol is None else rtol
    numbers = (t_start, t_end, dt, save_every, rho_inf, tolerance, rtol, atol)
    settings = Settings(*numbers, progress, method, order=order, stabilised=stabilised)
    if state is None and dt is not None and dt > (t_end - t_start) * (1 + 1e-9):
        text = f"dt = {dt:g} s is longer than the motion of {t_end - t_start:g} s"
        raise ConfigError(f"{text}; take a shorter one, or none: steps are then chosen by rtol.")
    settings, packed = settings.after(state), pack(mechanism, sampled=True)
    settings.check_room(packed)
    check_samples(packed, settings)
    record = Record(
        mechanism, packed, settings, perf_counter(), given=state, keeping=keep, assemble=assemble
    )
    with terminable():
        try:
            return _moved(record, t_start)
        except BaseException as raised:
            error = _translated(raised, record)
            error.solution = _rescued(error, record)
            if error is raised:
                raise
            raise error from raised


@typed
def release(mechanism: Mechanism, state: State, *, assemble: bool = False) -> State:
    """State of a mechanism in the position and motion of another one with the same bodies.

    What follows when a brake is let go, a latch closes or a drive gives way to a motor: positions
    and velocities stay, as near as the joints of this mechanism allow; accelerations and reactions
    are its own. Joint angles count from where its bodies were added, turns beyond one from here.

    Args:
        mechanism: what moves on; the same bodies added in the same order.
        state: of the other mechanism, e.g. from `rom.equilibrium` or ``solution.final``.
        assemble: see `simulate`.

    Returns:
        State to go on from: ``rom.simulate(mechanism, state=..., ...)``.

    Raises:
        ConfigError: if the bodies are not the same.
        ModelError: naming a joint that is open there.
    """
    packed = pack(mechanism, sampled=True)
    check_state(state, packed, joints=False)
    placed = replace(packed, q=state.q.copy(), v=state.v.copy())
    return initial_state(placed, state.t, assemble=assemble)


def _moved(record: Record, t_start: float) -> Solution:
    """The motion of a record that stands at its start."""
    if record.keeping is not None:
        _go_on(record, record.keeping)
    settings, packed = record.settings, record.packed
    if record.given is None:
        record.given = initial_state(packed, t_start, settings.spacing, assemble=record.assemble)
    state = record.given
    check_fit(state, packed, record.mechanism)
    record.packed = packed = packed.of_rank(state.rank)
    if record.mechanism.events:
        instant = Instant(record.mechanism, packed)
        record.watch = Watch(dict(record.mechanism.events), instant, t_start, packed)
    run = METHODS[settings.method]
    if settings.dt is None and run is run_implicit:
        run = run_variable
    if record.blocks and state.t >= settings.t_end:
        record.stand_still(state)
    else:
        run(record, workspace(packed.system, len(packed.signals)), state)
    stop = record.watch.stop if record.watch else None
    reached = f"Reached t = {settings.t_end:g} s."
    stopped = "Stopped by event {!r} at t = {:.9g} s."
    solution = record.solution(stopped.format(*stop) if stop else reached)
    warn_of_limits(solution)
    warn_of_failures(solution)
    return solution


def _go_on(record: Record, keeping: Keeping) -> None:
    """Let the record stand where an interrupted run left what it kept."""
    settings = record.settings
    keeping.begin(settings.origin, settings.taken, digests_of(record.packed, settings.arguments))
    if not keeping.resume:
        return
    kept = keeping.read()
    h, begun = kept.memory.h, kept.memory.taken - kept.taken
    if settings.dt is not None and kept.state.t < settings.t_end and h != settings.h:
        text = f"t_end = {settings.t_end:g} s would change the steps of the interrupted run from"
        hint = f"Take its own t_end, or a multiple of {h:.9g} s."
        raise ConfigError(f"{text} {h:.9g} s to {settings.h:.9g} s: it cannot go on.", hint=hint)
    record.settings = replace(settings, origin=kept.origin, taken=kept.taken, begun=begun)
    record.given, record.blocks, record.noted = kept.state, kept.blocks, kept.noted


def _translated(raised: BaseException, record: Record) -> Any:
    """The error by which a run ends."""
    if isinstance(raised, KeyboardInterrupt):
        text = f"interrupted at t = {record.t:.6g} s of {record.settings.t_end:g} s."
        return InterruptedRun(text, hint="The motion up to there is kept in error.solution.")
    if isinstance(raised, MemoryError):
        text = f"the memory ran out at t = {record.t:.6g} s."
        hint = "Keep fewer instants (save_every). error.solution is the motion up to there."
        return ResourceError(text, hint=hint)
    return raised


def _rescued(error: BaseException, record: Record) -> Solution | None:
    """The motion up to an error, which is written too if it is to be kept."""
    if not record.blocks or record.final is None:
        return None
    with suppress(RomError):  # for one, because the disk is full: the first error counts
        if record.keeping is not None:
            record.keeping.write(record.blocks, record.final, record.noted)
    record.keep_last()
    interrupted = isinstance(error, InterruptedRun)
    solution = record.solution(f"{'' if interrupted else 'Stopped: '}{error}", failed=True)
    with suppress(RomError, RomWarning):
        warn_of_limits(solution)
    return solution


def check_fit(state: State, packed: Packed, mechanism: Mechanism) -> None:
    """Compiled code does not look at the size of its arrays, so this is the place to do it."""
    check_state(state, packed)
    angles = packed.followed if state.base is None else np.size(state.base)
    if angles != packed.followed:
        remembering = [name for name, law in mechanism.laws.items() if law.memory.size]
        text = f"the state has {angles} followed joint coordinates and remembered numbers; this"
        hint = f"Its laws that remember are {remembering}." if remembering else ""
        raise ConfigError(f"{text} mechanism has {packed.followed}.", hint=hint)
