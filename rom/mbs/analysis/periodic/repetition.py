"""What cannot repeat is refused by name before any motion is looked for."""

import numpy as np

from rom.errors import ModelError
from rom.mbs.analysis.periodic.flow import Flow, Start
from rom.mbs.analysis.periodic.turns import FULL_TURN, Turns
from rom.mbs.kernels.system import ANGLE
from rom.mbs.parts.signals import Signal
from rom.model import Array

REPEAT_RTOL = 1e-6  # of the largest value: by which a function may differ a period later
SHARES = np.array([0.0, 0.137, 0.291, 0.433, 0.618, 0.809])  # of the period, at which one looks
FORCE_RTOL = 1e-6  # of all forces


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


def _refuse_signal(
    flow: Flow, turns: Turns, signal: Signal, shift: float, driven: bool
) -> None:
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
            hint="Give the period of all drives and loads; for what advances, turns={joint: "
            "angle}.",
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
    told = turns.of(drive.joint)
    if told is None:
        return change - change[0]
    return np.asarray((change - told + np.pi) % FULL_TURN - np.pi)


def _refuse_forces(flow: Flow, start: Start, shift: float, driven: bool) -> None:
    """Laws ask for the time by themselves: at one state forces must be the same later."""
    if not flow.mechanism.elements:
        return
    state = start.state
    for share in SHARES:
        t = flow.t0 + share * flow.period
        forces = []
        for when in (t, t + shift):
            now = flow.now.at(when)
            now.W.base[:] = state.base
            forces.append(now.residual(state.q, state.v, state.a, 0 * state.lam))
        size = np.abs(forces[0]).max(initial=0.0)
        worst = int(np.argmax(np.abs(forces[1] - forces[0])))
        if abs(forces[1][worst] - forces[0][worst]) > FORCE_RTOL * size:
            bodies = flow.packed.system.bodies
            name = flow.packed.names[int(np.searchsorted(bodies.v_at, worst, "right")) - 1]
            raise ModelError(
                f"the forces on {name!r} do not repeat with the period {flow.period:.9g} s: a law "
                f"depends on time." if driven else
                f"the forces on {name!r} change with time, so that the period is not free.",
                where=name,
                hint="Give the period of all laws.",
            )
