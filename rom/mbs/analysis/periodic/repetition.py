"""What cannot repeat is refused by name before any motion is looked for."""

from dataclasses import replace

import numpy as np

from rom.errors import ModelError
from rom.mbs.analysis.periodic.flow import Flow, Start
from rom.mbs.analysis.periodic.shooting import Return
from rom.mbs.analysis.periodic.turns import FULL_TURN, Turns
from rom.mbs.kernels.system import ANGLE
from rom.mbs.parts.signals import Signal
from rom.model import Array

REPEAT_RTOL = 1e-6  # of the largest value: by which a function may differ a period later
SHARES = np.array([0.0, 0.137, 0.291, 0.433, 0.618, 0.809])  # of the period, at which one looks
FORCE_RTOL = 1e-6  # of all forces
LATER_RTOL = 1e-2  # the same at the end of a motion whose gap is closed: contact is stiff


def refuse_what_changes(flow: Flow, turns: Turns, start: Start, driven: bool) -> None:
    """Refuse drives, loads and laws that are not the same a period later.

    Args:
        flow: the mechanism.
        turns: what advances.
        start: a state of it.
        driven: whether the period is given; if not, nothing may depend on time.

    Raises:
        ModelError: naming the drive, load or law.
    """
    shift = flow.period if driven else flow.period * np.sqrt(2)  # no period of anything
    for signal in flow.packed.signals:
        if signal.name != "clock":
            _refuse_signal(flow, turns, signal, shift, driven)
    _refuse_forces(flow, start, shift, driven)


def _refuse_signal(flow: Flow, turns: Turns, signal: Signal, shift: float, driven: bool) -> None:
    t = flow.t0 + SHARES * flow.period
    both = np.concatenate([t, t + shift])
    spacing = flow.settings.spacing
    found = signal.sample(both, (-np.inf, np.inf), spacing)
    one, two = found[: t.size], found[t.size :]
    change = two - one
    if signal.width == 1:
        change = change[:, :2]
        change[:, 0] = _beyond(flow, turns, signal.name, change[:, 0])
        scale = np.abs(one[:, :2]).max(axis=0) + np.array([1e-3, 1e-3]) * np.abs(one[:, 0]).max()
        scale[1] += scale[0] / flow.period
    else:
        scale = np.abs(found).max()
    if np.all(np.abs(change) <= REPEAT_RTOL * np.maximum(scale, 1e-300)):
        return
    if driven:
        raise ModelError(
            f"{signal.name!r} does not repeat with the period {flow.period:.9g} s: a period later "
            f"it differs by {np.abs(change).max():.3g}.",
            where=signal.name,
            hint="Give the period of all drives and loads; turns= says by how much joints advance.",
        )
    raise ModelError(
        f"{signal.name!r} changes with time, so that the period is not free.",
        where=signal.name,
        hint="Give period= that of drives and loads.",
    )


def _beyond(flow: Flow, turns: Turns, name: str, change: Array) -> Array:
    """What of the change of a drive is more than its joint may advance."""
    drive = flow.mechanism.drives.get(name)
    if drive is None:
        return change
    row = flow.mechanism.joints[drive.joint].coordinate
    if row is None or row.kind != ANGLE:
        return change
    prescribed = turns.of(drive.joint)
    if prescribed is None:
        return change - change[0]
    return np.asarray((change - prescribed + np.pi) % FULL_TURN - np.pi)


def _refuse_forces(flow: Flow, start: Start, shift: float, driven: bool) -> None:
    """Laws ask for the time by themselves: at one state forces must be the same later."""
    for t in flow.t0 + SHARES * flow.period:
        one, two = (flow.forces(replace(start.state, t=when)) for when in (t, t + shift))
        k = int(np.argmax(np.abs(two - one)))
        if abs(two[k] - one[k]) <= FORCE_RTOL * np.abs(one).max():
            continue
        name = _body(flow, k)
        if driven:
            raise ModelError(
                f"the forces on {name!r} do not repeat with the period {flow.period:.9g} s.",
                where=name,
                hint="Give the period of all laws that depend on time.",
            )
        raise ModelError(
            f"the forces on {name!r} change with time, so that the period is not free.",
            where=name,
            hint="Give period= that of the laws.",
        )


def refuse_other_forces(found: Return) -> None:
    """Refuse a motion at whose end other forces act than at its start.

    Elements follow angles over whole turns, and know one tooth from the next.

    Raises:
        ModelError: naming the body.
    """
    flow, end = found.flow, found.end
    later = replace(end, algorithmic=flow.forces(end))  # forces turn with the frames, as rates do
    two = found.turns.back(later, found.turns.angles(found.start.state, end)).algorithmic
    one = flow.forces(replace(found.turned, t=flow.t0, base=found.base))
    assert two is not None
    k = int(np.argmax(np.abs(two - one)))
    if abs(two[k] - one[k]) > LATER_RTOL * max(np.abs(one).max(), np.abs(two).max()):
        name = _body(flow, k)
        raise ModelError(
            f"after the period other forces act on {name!r} in the same place: "
            f"{two[k]:.4g} for {one[k]:.4g} N or N m.",
            where=name,
            hint="An element knows how far it has turned: turns must fit each other, as those of "
            "two wheels do, and springs about an axis must not be wound up.",
        )


def _body(flow: Flow, k: int) -> str:
    """Name of the body to which coordinate k belongs."""
    return flow.packed.names[int(np.searchsorted(flow.packed.system.bodies.v_at, k, "right")) - 1]
