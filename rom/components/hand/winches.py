"""From commands of the control chart to winches: motors that follow at a limited speed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from rom.arguments import positive
from rom.components.hand.moving_hand import Drive
from rom.errors import ConfigError
from rom.model import Array

FINGERS = ("thumb", "index", "middle", "ring", "little")  # columns of `Commands.fingers`


@dataclass(frozen=True)
class Motor:
    """A winch that goes to where it is told, never faster than it can.

    Attributes:
        rate: fastest change of the pull [m/s].
        lag: time constant with which it follows [s].
    """

    rate: float = 0.04
    lag: float = 0.02

    def follow(self, pulls: npt.ArrayLike, dt: float) -> Array:
        """Pull that the winch reaches, from what it is told.

        The speed is that of a first-order lag, cut off at the rate: s' = (command - s) / lag.

        Args:
            pulls: (n, k) commands [m].
            dt: between samples [s].

        Returns:
            (n, k) [m], at rest at the first command.

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
    """
    commands = np.asarray(pulls, dtype=float)
    if commands.ndim != 2 or commands.shape[1] != len(names) or len(commands) < 2:
        raise ConfigError(
            f"commands of shape {commands.shape} are none for the {len(names)} fingers "
            f"{', '.join(names)} at two instants or more."
        )
    reached = (motor or Motor()).follow(commands, dt)
    t = dt * np.arange(len(reached))
    base = drive or Drive()
    return {
        name: Drive(None, _Held(PchipInterpolator(t, y), t[-1]), base.EA, base.damping,
                    base.conduit, base.transition_speed)
        for name, y in zip(names, reached.T, strict=True)
    }  # fmt: skip


@dataclass(frozen=True)
class _Held:
    """A pull over time that stays what it was at the end."""

    curve: PchipInterpolator
    last: float

    def __call__(self, t: float) -> float:
        return float(self.curve(min(max(t, 0.0), self.last)))
