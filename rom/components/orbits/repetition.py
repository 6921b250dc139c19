"""What cannot repeat is refused by name before any motion is looked for."""

from dataclasses import replace

import numpy as np

from rom.components.orbits.flow import Flow, Start
from rom.components.orbits.shooting import FULL_TURN, Return, Turns
from rom.errors import ModelError
from rom.mbs.kernels.system import ANGLE
from rom.mbs.parts.signals import Signal
from rom.mbs.results.state import State
from rom.model import Array

REPEAT_RTOL = 1e-6  # of the largest value: by which a function may differ a period later
SHARES = np.array([0.0, 0.137, 0.291, 0.433, 0.618, 0.809])  # of the period, at which one looks
FORCE_RTOL = 1e-6  # of all forces
PHASE_TOL = 1e-5  # of a tooth
MAX_POWER = 12  # of ten: so many periods later, what hardly changes in one must be the same
# of a time: so much later, round-off may have moved what turns; forces that differ then may differ
TIME_RTOL = 1e-14
LATER_RTOL = 1e-2  # the same at the end of a motion whose gap is closed: contact is stiff


def refuse_what_changes(flow: Flow, turns: Turns, start: Start, driven: bool) -> None:
    """Refuse drives, loads and laws that are not the same a period later.

    Where the period is not given, nothing is driven: nothing may depend on time.
    """
    # oil that is conserved fills films over revolutions, and heat slower: no unknowns here
    for name in flow.packed.remembering:
        text = f"{name!r} remembers its oil, its heat, or where friction held, beyond a period."
        hint = "Give a film cavitation='reynolds' and a viscosity as its oil, or simulate."
        raise ModelError(text, where=name, hint=hint)
    shift = flow.period if driven else flow.period * np.sqrt(2)  # no period of anything
    for signal in flow.packed.signals:
        if signal.name != "clock":
            _refuse_signal(flow, turns, signal, shift, driven)
    _refuse_forces(flow, start, shift, driven)
    if driven:
        later = replace(start.state, t=flow.t0 + shift)
        _refuse_parts(_phases(flow, start.state), _phases(flow, later))


def _phases(flow: Flow, state: State) -> dict[str, float]:
    flow.forces(state)
    return flow.now.packed.phases(flow.now.W)


def _refuse_parts(one: dict[str, float], two: dict[str, float]) -> None:
    """Refuse parts of a tooth: contact may be the same by chance at the instants that are seen."""
    for name, phase in one.items():
        passed = two[name] - phase
        if abs(passed - round(passed)) > PHASE_TOL:
            text = f"mesh {name!r} has gone on by {passed:.6g} teeth, not by whole ones."
            hint = "Give the period of the teeth, or a multiple; turns= of whole teeth."
            raise ModelError(text, where=name, hint=hint)


def _refuse_signal(flow: Flow, turns: Turns, signal: Signal, shift: float, driven: bool) -> None:
    t = flow.t0 + SHARES * flow.period
    both = np.concatenate([t, t + shift])
    found = signal.sample(both, (-np.inf, np.inf), flow.settings.spacing)
    one, change = found[: t.size], found[t.size :] - found[: t.size]
    if signal.width == 1:
        change = change[:, :2]
        change[:, 0] = _beyond(flow, turns, signal.name, change[:, 0])
        scale = np.abs(one[:, :2]).max(axis=0) + 1e-3 * np.abs(one[:, 0]).max()
        scale[1] += scale[0] / flow.period
    else:
        scale = np.abs(found).max()
    still = np.abs(one[:, : change.shape[1]] - one[0, : change.shape[1]])
    if np.all(still <= REPEAT_RTOL * np.maximum(scale, 1e-300)) and driven:
        change = _much_later(flow, turns, signal, one[:1, : change.shape[1]])
    if np.all(np.abs(change) <= REPEAT_RTOL * np.maximum(scale, 1e-300)):
        return
    by = f"a period later it differs by {np.abs(change).max():.3g}"
    cure = "Give the period of all drives and loads; turns= says by how much joints advance."
    raise _changing(flow, signal.name, f"{signal.name!r}", driven, by, cure)


def _changing(flow: Flow, name: str, what: str, driven: bool, by: str, cure: str) -> ModelError:
    """The refusal of what is not the same a period later, or at any time where none is given."""
    text, hint = f"{what} does not repeat with the period {flow.period:.9g} s: {by}.", cure
    if not driven:
        text = f"{what} changes with time, so that the period is not free."
        hint = "Give period= that of drives, loads and laws."
    return ModelError(text, where=name, hint=hint)


def _much_later(flow: Flow, turns: Turns, signal: Signal, now: Array) -> Array:
    """(k, .) changes after many periods of what hardly changes in one: it may be far too short."""
    n = 10.0 ** np.arange(MAX_POWER + 1)
    t = flow.t0 + n * flow.period
    change = signal.sample(t, (-np.inf, np.inf), flow.settings.spacing)[:, : now.shape[1]] - now
    if signal.width == 1:
        change[:, 0] = _beyond(flow, turns, signal.name, change[:, 0], n)
    return np.where(np.isfinite(change), change, 0.0)  # where its table has ended


def _beyond(flow: Flow, turns: Turns, name: str, change: Array, n: Array | float = 1.0) -> Array:
    """What of the change of a drive in n periods is more than its joint may advance."""
    drive = flow.mechanism.drives.get(name)
    if drive is None:
        return change
    row = flow.mechanism.joints[drive.joint].coordinate
    if row is None or row.kind != ANGLE:
        return change
    prescribed = turns.of(drive.joint)
    if prescribed is None:
        return change - change[0]
    return np.asarray((change - n * prescribed + np.pi) % FULL_TURN - np.pi)


def _refuse_forces(flow: Flow, start: Start, shift: float, driven: bool) -> None:
    """Laws ask for the time by themselves: at one state forces must be the same later."""
    times = flow.t0 + SHARES * flow.period
    now = [flow.forces(replace(start.state, t=t)) for t in times]
    later = times + shift
    if max(np.abs(x - now[0]).max() for x in now) <= FORCE_RTOL * flow.pressed:
        later = flow.t0 + shift * 10.0 ** np.linspace(0, MAX_POWER, SHARES.size).round()
    for one, t in zip(now, later, strict=True):
        two = flow.forces(replace(start.state, t=t))
        k = int(np.argmax(np.abs(two - one)))
        if abs(two[k] - one[k]) <= FORCE_RTOL * max(np.abs(one).max(), flow.pressed):
            continue
        near = [flow.forces(replace(start.state, t=t * x)) for x in (1 - TIME_RTOL, 1 + TIME_RTOL)]
        if abs(two[k] - one[k]) <= max(np.abs(x - two)[k] for x in near):
            continue
        name, by = _body(flow, k), f"they differ by {abs(two[k] - one[k]):.3g}"
        cure = "Give the period of all laws that depend on time."
        raise _changing(flow, name, f"the sum of forces on {name!r}", driven, by, cure)


def refuse_other_forces(found: Return) -> None:
    """Refuse a motion at whose end other forces act than at its start.

    Elements follow angles over whole turns, and know one tooth from the next.
    """
    flow, end = found.flow, found.end
    later = replace(end, algorithmic=flow.forces(end))  # forces turn with the frames, as rates do
    two = found.turns.back(later, found.turns.angles(found.start.state, end)).algorithmic
    passed = flow.now.packed.phases(flow.now.W)
    one = flow.forces(replace(found.turned, t=flow.t0, base=found.base))
    _refuse_parts(flow.now.packed.phases(flow.now.W), passed)
    assert two is not None
    k = int(np.argmax(np.abs(two - one)))
    size = max(np.abs(one).max(), np.abs(two).max(), flow.pressed)
    if abs(two[k] - one[k]) > LATER_RTOL * size:
        name = _body(flow, k)
        text = f"after the period other forces act on {name!r} in the same place: {two[k]:.4g} for"
        hint = "Turns must fit each other, as those of two wheels do, and springs not be wound up."
        raise ModelError(f"{text} {one[k]:.4g} N or N m.", where=name, hint=hint)


def _body(flow: Flow, k: int) -> str:
    """Name of the body to which coordinate k belongs."""
    return flow.packed.names[int(np.searchsorted(flow.packed.system.bodies.v_at, k, "right")) - 1]
