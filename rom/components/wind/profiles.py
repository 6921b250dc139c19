"""Profiles of the blade of the NREL 5 MW turbine: lift and drag over all angles of attack.

Published tables go once round; one that ends at stall is carried on as a plate in a separated flow.

Source:
    Jonkman, Butterfield, Musial, Scott, NREL/TP-500-38060, 2009, section 3 and appendix B: profiles
    of the DOWEC study, corrected for stall delay and with Viterna's drag; the numbers as the
    regression tests of OpenFAST have them.
    Viterna, Corrigan, Fixed pitch rotor performance of large horizontal axis wind turbines, 1982.
    Snel, Houwink, Bosschers, Sectional prediction of lift coefficients on rotating wind turbine
    blades in stall, ECN-C--93-052, 1994: the factor three.
"""

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import Positive, not_negative, typed, vector
from rom.errors import ConfigError
from rom.model import Array

ROUND_ATOL = 1e-6  # [rad]: how far from -pi and pi a table may begin and end
PROFILE_TABLE = Path(__file__).parent / "nrel5mw_profiles.csv"
STALL_DELAY_FACTOR = 3.0  # of (chord / radius)^2, after Snel
STALL_DELAY_END = np.radians((30.0, 50.0))  # [rad]: from here to there the delay fades
CAMBER_SHARE = 0.7  # of the lift, where the flow meets the wrong side or the wrong edge
BLADE_ASPECT_RATIO = 17.0  # of the blade, length over chord: what its profiles were corrected with


@typed
@dataclass(frozen=True)
class Profile:
    """Coefficients of a profile.

    Attributes:
        name: of the profile.
        angle: (k,) of attack, ascending, from -pi to pi [rad].
        lift: (k,) coefficient [1].
        drag: (k,) coefficient [1].

    Raises:
        ConfigError: naming the profile, for a table that cannot be or does not go once round.
    """

    name: str
    angle: Array
    lift: Array
    drag: Array

    def __post_init__(self) -> None:
        a = self.angle
        _check(self.name, a, self.lift, self.drag)
        if a[0] > ROUND_ATOL - np.pi or a[-1] < np.pi - ROUND_ATOL:
            first, last = np.degrees(a[[0, -1]])
            text = f"profile {self.name!r} is known from {first:g} to {last:g} degrees."
            raise ConfigError(text, hint="wind.profiles.profile carries a table on past stall.")

    @property
    def table(self) -> Array:
        """(3, k) angles [rad], lift and drag [1]."""
        return np.array([self.angle, self.lift, self.drag])

    def rotating(self, chord_over_radius: float) -> "Profile":
        """The profile on a blade that turns, whose stall is late where the blade is wide.

        Above zero lift a share 3 (c / r)^2 of what lacks to potential flow comes back, at most all,
        up to 30 degrees, with the ratio c / r of the chord to the distance from the axis [1]; it
        fades to none at 50, and drag stays. What has no lift stays as it is. Profiles of the 5 MW
        turbine have such a delay already.

        Raises:
            ConfigError: for a ratio that is negative or not finite.
        """
        ratio = not_negative("chord_over_radius", chord_over_radius)
        begins = np.flatnonzero((self.lift[:-1] <= 0.0) & (self.lift[1:] > 0.0))
        if not begins.size:
            return self
        k = begins[np.abs(self.angle[begins]).argmin()]
        none = float(np.interp(0.0, self.lift[k : k + 2], self.angle[k : k + 2]))
        a = np.union1d(self.angle, np.arange(none, STALL_DELAY_END[1], np.radians(1.0)))
        lift, drag = (np.interp(a, self.angle, x) for x in (self.lift, self.drag))
        lacking = np.where(a > none, 2 * np.pi * (a - none) - lift, 0.0)
        share = min(STALL_DELAY_FACTOR * ratio**2, 1.0) * np.interp(a, STALL_DELAY_END, (1.0, 0.0))
        return Profile(self.name, a, lift + share * np.maximum(lacking, 0.0), drag)


@cache
def profiles() -> dict[str, Profile]:
    """The eight profiles of the blade, circles of the root first, by name."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    with PROFILE_TABLE.open(encoding="utf-8") as lines:
        for name, *numbers in list(csv.reader(lines))[1:]:
            rows.setdefault(name, []).append(tuple(map(float, numbers)))
    tables = {name: np.array(numbers).T for name, numbers in rows.items()}
    return {n: Profile(n, np.radians(a), lift, drag) for n, (a, lift, drag) in tables.items()}


@typed
def profile(
    name: str,
    angle: npt.ArrayLike,
    lift: npt.ArrayLike,
    drag: npt.ArrayLike,
    *,
    aspect: Annotated[float, Positive()] = BLADE_ASPECT_RATIO,
) -> Profile:
    """A profile from a table that may end at stall.

    Past its last angle a_s (past -a_s below zero) the flow is separated, with
    D = 1.11 + 0.018 aspect::

        drag = D sin(a)^2 + B cos(a)
        lift = D sin(2 a) / 2 + A cos(a)^2 / sin(a)

    A and B such that both are continuous at a_s. Below zero and in flow from behind, of more than a
    right angle, lift is 0.7 times that of the mirrored angle; straight from behind it is zero.

    Args:
        name: of the profile.
        angle: (k,) of attack, ascending [rad].
        lift: (k,) coefficient [1].
        drag: (k,) coefficient, not negative [1].
        aspect: length over chord of the blade [1].

    Raises:
        ConfigError: naming the profile, for a table that cannot be.
    """
    given = {"angle": angle, "lift": lift, "drag": drag}
    a, cl, cd = (vector(f"{what} of profile {name!r}", x) for what, x in given.items())
    _check(name, a, cl, cd)
    if a[0] <= ROUND_ATOL - np.pi and a[-1] >= np.pi - ROUND_ATOL:
        return Profile(name, a, cl, cd)
    return _carried_on(name, (a, cl, cd), 1.11 + 0.018 * aspect)


def _check(name: str, a: Array, cl: Array, cd: Array) -> None:
    if a.size < 2 or a.shape != cl.shape or a.shape != cd.shape:
        sizes = f"{a.size} angles, {cl.size} lifts and {cd.size} drags"
        why = f"has {sizes}; as many of each, two or more."
    elif (np.diff(a) <= 0.0).any() or a[0] < -np.pi - ROUND_ATOL or a[-1] > np.pi + ROUND_ATOL:
        why = "has angles that do not ascend within -pi to pi [rad]."
    elif (cd < 0.0).any():
        why = f"has a drag of {cd.min():g}; it must not be negative."
    elif not 0.0 < a[-1] < np.pi / 2 and a[-1] < np.pi - ROUND_ATOL:
        end = np.degrees(a[-1])
        why = f"ends at {end:g} degrees; stall lies between 0 and 90, or it goes once round."
    else:
        return
    raise ConfigError(f"profile {name!r} {why}")


def _carried_on(name: str, table: tuple[Array, Array, Array], D: float) -> Profile:
    """The table within stall, a plate in separated flow outside."""
    a, cl, cd = table
    s, c = np.sin(a[-1]), np.cos(a[-1])
    A, B = (cl[-1] - D * s * c) * s / c**2, (cd[-1] - D * s**2) / c
    first = np.ceil(np.degrees(a[-1])) + 1.0
    beyond = np.append(np.radians(np.arange(first, 90.0, 2.0)), np.pi / 2)
    lift = D / 2 * np.sin(2 * beyond) + A * np.cos(beyond) ** 2 / np.sin(beyond)
    drag = D * np.sin(beyond) ** 2 + B * np.cos(beyond)
    back = slice(-2, None, -1)  # mirrored at a right angle, flow from behind
    angle = np.concatenate([beyond, np.pi - beyond[back], [np.pi]])
    lift = np.concatenate([lift, -CAMBER_SHARE * lift[back], [0.0]])
    drag = np.concatenate([drag, drag[back], cd[:1]])
    below = np.flatnonzero(angle > max(-a[0], a[-1]) + 1e-6)[::-1]
    share = np.where(angle > np.pi / 2, 1.0, CAMBER_SHARE)
    mirrored = zip((-angle, -(share * lift), drag), table, (angle, lift, drag), strict=True)
    return Profile(name, *(np.concatenate([m[below], t, p]) for m, t, p in mirrored))
