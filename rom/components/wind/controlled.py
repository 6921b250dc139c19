"""The controller at work in a mechanism: torque of the generator, and actuators of the pitch.

A law between nacelle, generator, hub and blades measures the speed of the generator and remembers
what a `Controller` does from one accepted step to the next. It brakes the generator against the
nacelle, and turns each blade on its bearing towards the pitch that is asked for, by a spring and a
damper.

Source:
    Jonkman, Butterfield, Musial, Scott, NREL/TP-500-38060, 2009, section 7: the controller; the
    actuator has 30 Hz and two percent of critical damping with the inertia of a blade.
"""

import math
from functools import cache
from typing import Any

import numpy as np
from numba import carray

from rom import rotation
from rom.components.wind.control import Controller, advance
from rom.components.wind.wake import NEVER_BEFORE
from rom.components.wind.wind_turbine import GEAR_RATIO, N_BLADES
from rom.mbs.elements.law_calls import LAW_TYPES, compiled_entry
from rom.mbs.kernels.compiled import inner
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.model import Array

# between the pitch that is asked for and that of a blade [N m/rad, N m s/rad]
PITCH_STIFFNESS, PITCH_DAMPING = 971.35e6, 0.206e6
CONTROLLER_SIZE = 5  # remembered: filtered speed, integral, pitch, torque, and the instant
# markers: nacelle, generator, and flange and root of each blade; numbers of the axis, the first
# pitch, and two directions of each blade without further pitch
N_MARKERS, N_NUMBERS = 2 + 2 * N_BLADES, 4 + 6 * N_BLADES


@inner
def turn_of_blade(flange, root, given, out):
    """How far a blade has pitched further [rad], positive as the controller counts.

    ``flange`` and ``root`` have axes (3, 3); ``given`` (6,) the first two axes of the root at the
    start, in axes of the flange. Fills (3,) the axis of the bearing.
    """
    along = beside = 0.0
    for i in range(3):
        out[i] = root[3 * i + 2]
        for j in range(3):
            along += root[3 * i] * flange[3 * i + j] * given[j]
            beside += root[3 * i] * flange[3 * i + j] * given[3 + j]
    return math.atan2(-beside, along)


def control(t, parameters, motion, memory, out):
    """Torque of the generator and moments of the actuators, a law of N_MARKERS markers."""
    n = N_MARKERS
    given, known = carray(parameters, (N_NUMBERS,)), carray(memory, (CONTROLLER_SIZE,))
    moved, answer = carray(motion, (18 * n,)), carray(out, (6 * n + 2 + CONTROLLER_SIZE + 2,))
    axes, omega = moved[3 * n : 12 * n], moved[15 * n : 18 * n]
    moment, kept = answer[3 * n : 6 * n], answer[6 * n + 2 :]
    axis, state, speed = np.empty(3), np.empty(4), 0.0
    for i in range(3):
        axis[i] = axes[3 * i] * given[0] + axes[3 * i + 1] * given[1] + axes[3 * i + 2] * given[2]
        speed += (omega[3 + i] - omega[i]) * axis[i]
    for i in range(4):
        state[i] = known[i]
    if known[4] > NEVER_BEFORE and t > known[4]:
        advance(state, speed, t - known[4])
    for i in range(4):
        kept[i] = state[i]
    kept[4] = max(t, known[4])
    kept[5], kept[6] = state[2], state[3]
    for i in range(3):
        moment[i] = state[3] * axis[i]
        moment[3 + i] = -state[3] * axis[i]
    for k in range(N_BLADES):
        a, b = 2 + 2 * k, 3 + 2 * k
        flange, root = axes[9 * a : 9 * a + 9], axes[9 * b : 9 * b + 9]
        angle = given[3] + turn_of_blade(flange, root, given[4 + 6 * k : 10 + 6 * k], axis)
        rate = 0.0
        for i in range(3):
            rate -= (omega[3 * b + i] - omega[3 * a + i]) * axis[i]
        held = PITCH_STIFFNESS * (state[2] - angle) - PITCH_DAMPING * rate
        for i in range(3):
            moment[3 * b + i] = -held * axis[i]
            moment[3 * a + i] = held * axis[i]


@cache
def compiled_control() -> Any:
    """The compiled law."""
    return compiled_entry(control, LAW_TYPES)


def add_control(
    mechanism: Mechanism,
    markers: tuple[Marker, ...],
    axis: Array,
    start: tuple[float, float],
) -> None:
    """Let the published controller work as the law "control".

    Args:
        mechanism: that has them.
        markers: of nacelle and generator, then of hub and root of each blade.
        axis: (3,) of the shaft, downwind, world [1].
        start: speed of the rotor [rad/s] and pitch [rad] of all blades, both of the start.
    """
    speed, pitch = start
    axes = [rotation.matrix(mechanism.part(m.body).p) for m in markers]
    one = Controller.at(GEAR_RATIO * speed, pitch)
    turned = [(A.T @ B)[:, :2].T.ravel() for A, B in zip(axes[2::2], axes[3::2], strict=True)]
    mechanism.law(
        "control",
        compiled_control(),
        *markers,
        parameters=np.concatenate([axes[0].T @ axis, [pitch], *turned]),
        memory=[one.filtered, one.integral, one.pitch, one.torque, NEVER_BEFORE],
        outputs=["pitch", "torque"],
    )
