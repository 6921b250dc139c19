"""From commands of the control chart to winches: motors that follow at a limited speed.

Either each cable has a motor, or the drums of one shaft draw in several.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from rom.arguments import finite, positive, whole
from rom.components.hand.moving_hand import Course, Drive
from rom.mbs.results.solution import Solution
from rom.model import Array

FINGERS = ("thumb", "index", "middle", "ring", "little")  # columns of `Commands.fingers`


@dataclass(frozen=True)
class Motor:
    """A winch that follows a command, never faster than it can.

    Attributes:
        rate: fastest change of the pull [m/s].
        lag: time constant with which it follows [s].
    """

    rate: float = 0.04
    lag: float = 0.02

    def follow(self, pulls: npt.ArrayLike, dt: float) -> Array:
        """(n, k) pull [m] that the winch reaches, at rest at the first command.

        The speed is that of a first-order lag, cut off at the rate: s' = (command - s) / lag.
        Commands are (n, k) pulls [m] that are dt apart [s].

        Raises:
            ConfigError: for numbers that no motor has.
        """
        commands = np.asarray(pulls, dtype=float)
        lag = max(positive("lag", self.lag), positive("dt", dt))
        step = positive("rate", self.rate) * dt
        reached = np.empty_like(commands)
        reached[0] = now = commands[0]
        for k, command in enumerate(commands[1:], start=1):
            now = now + np.clip((command - now) * dt / lag, -step, step)
            reached[k] = now
        return reached


def winches(
    pulls: npt.ArrayLike,
    dt: float,
    *,
    motor: Motor | None = None,
    drive: Drive | None = None,
    names: Sequence[str] = FINGERS,
) -> Mapping[str, Drive]:
    """Drives of a moving hand that follow commands over time, and hold the last one.

    Args:
        pulls: (n, k) commands of k fingers [m], as of `Commands.fingers`.
        dt: between samples [s].
        motor: that follows; None for `Motor()`.
        drive: cable, conduit and the rest; None for `Drive()`.
        names: (k,) of the fingers.

    Raises:
        ConfigError: if fingers and commands differ in number.

    Source:
        Two signals of muscles that command five fingers: Potratz and others, J. Biomech. Eng. 127
        (2005) 934.
    """
    commands = finite(f"pulls of {', '.join(names)}", pulls, (None, len(names)))
    whole("instants of pulls", len(commands), 2)
    reached = (motor or Motor()).follow(commands, dt)
    t = dt * np.arange(len(reached))
    curves = {name: PchipInterpolator(t, y) for name, y in zip(names, reached.T, strict=True)}
    return _pulled(drive, {name: partial(_held, curve, t[-1]) for name, curve in curves.items()})


def shaft(
    angle: Callable[[float], float], radii: Mapping[str, float], *, drive: Drive | None = None
) -> Mapping[str, Drive]:
    """Drives of fingers whose cables run onto drums of one shaft.

    Args:
        angle: of the shaft as a function of time [rad].
        radii: {finger: radius of its drum} [m].
        drive: cable, conduit and the rest; None for `Drive()`.

    Raises:
        ConfigError: for a radius that is none.
    """
    for name, r in radii.items():
        positive(f"radius of {name}", r)
    return _pulled(drive, {name: partial(_drawn, r, angle) for name, r in radii.items()})


def shaft_moment(solution: Solution, radii: Mapping[str, float]) -> Array:
    """(n_t,) moment with which a motor holds the shaft of drums, sum of radius times tension [N m].

    The motion is that of a moving hand with drives of `shaft` of these radii [m].
    """
    none = np.zeros(solution.t.size)
    return sum((r * motor_force(solution, name) for name, r in radii.items()), none)


def motor_force(solution: Solution, name: str) -> Array:
    """(n_t,) tension of the cable of a finger, or a joint, at its first end, at the motor [N]."""
    first: Array = solution.element(f"{name} cable").force[:, 0]
    return np.linalg.norm(first, axis=1)


def _pulled(drive: Drive | None, pulls: Mapping[str, Course]) -> Mapping[str, Drive]:
    base = replace(drive or Drive(), tension=None)
    return {name: replace(base, pull=pull) for name, pull in pulls.items()}


def _drawn(radius: float, angle: Callable[[float], float], t: float) -> float:
    """What has run onto a drum of a shaft [m]."""
    return radius * angle(t)


def _held(curve: PchipInterpolator, last: float, t: float) -> float:
    """A pull over time that stays what it was at the end [m]."""
    return float(curve(min(max(t, 0.0), last)))
