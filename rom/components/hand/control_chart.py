"""A chart that turns two signals of muscles into commands for five groups of fingers.

Flexor x and extensor y of the wrist, each from 0 at rest to 1 at full effort, are a point of the
unit square. Its distance max(x, y) from the corner says how far to close, its direction which
group: five sectors of 18 degrees. Weak signals hold; a group is left only after the direction has
been beyond its border for a while; both muscles together, strong and long, switch between closing
and opening.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import butter, lfilter

from rom.arguments import one_each, positive
from rom.errors import ConfigError
from rom.model import Array, Index, Mask

GROUPS = ("thumb", "index", "middle", "ring and little", "all")
COUPLINGS = np.array(  # (5 fingers, 5 groups): which fingers a group draws
    [[1, 0, 0, 0, 1], [0, 1, 0, 0, 1], [0, 0, 1, 0, 1], [0, 0, 0, 1, 1], [0, 0, 0, 1, 1]],
    dtype=float,
)
NO_GROUP = -1


@dataclass(frozen=True)
class Chart:
    """Borders and times of the chart.

    Attributes:
        threshold: effort below which nothing moves [1].
        full: effort beyond the threshold that draws the cable all the way [1].
        margin: beyond a border before a group is left [rad].
        dwell: how long it must be left [s].
        together: effort and time [s] of both muscles that switch between closing and opening.
        middle: how far from the diagonal both muscles count as together [rad].
        rate: fastest change of the pull [m/s].
        pull: of a closed finger [m].
    """

    threshold: float = 0.12
    full: float = 0.68
    margin: float = math.radians(2.0)
    dwell: float = 0.15
    together: tuple[float, float] = (0.8, 0.3)
    middle: float = math.radians(9.0)
    rate: float = 0.04
    pull: float = 14e-3

    def group(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Index:
        """(...,) group that points of the square belong to, `NO_GROUP` for none; no memory.

        Flexor x and extensor y (...,) go from 0 to 1 [1].
        """
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        sector = np.minimum((np.arctan2(y, x) / (np.pi / 2) * len(GROUPS)).astype(int), 4)
        return np.where(np.maximum(x, y) < self.threshold, NO_GROUP, sector)

    def command(self, effort: npt.ArrayLike) -> Array:
        """(...,) pull [m] for an effort (...,), 0 to 1."""
        share = (np.asarray(effort, dtype=float) - self.threshold) / self.full
        return self.pull * np.clip(share, 0.0, 1.0)

    def follow(self, x: npt.ArrayLike, y: npt.ArrayLike, dt: float) -> "Commands":
        """Commands over time.

        Flexor x and extensor y (n,) go from 0 to 1 [1]; samples are dt apart [s].

        Raises:
            ConfigError: if the signals differ in length, or dt is not positive.
        """
        flexor, extensor = (np.array(part, dtype=float, ndmin=1) for part in (x, y))
        one_each("samples of the extensor", extensor.shape, "of the flexor", flexor.shape)
        positive("dt", dt)
        n = flexor.size
        groups, pulls = np.empty(n, dtype=np.int64), np.empty((n, len(GROUPS)))
        opening = np.empty(n, dtype=np.bool_)
        group, waited, both, opens, armed = NO_GROUP, 0.0, 0.0, False, True
        pull = np.zeros(len(GROUPS))
        for k, (a, b) in enumerate(zip(flexor, extensor, strict=True)):
            now = int(self.group(a, b))
            waited = 0.0 if now in (NO_GROUP, group) or self._near(a, b, group) else waited + dt
            if group == NO_GROUP or waited > self.dwell:
                group, waited = now, 0.0
            aside = abs(np.arctan2(b, a) - np.pi / 4)
            strong = min(a, b) > self.together[0] and aside < self.middle
            both = both + dt if strong else 0.0
            armed = armed or not strong
            if armed and both > self.together[1]:
                opens, armed = not opens, False
            if now != NO_GROUP and not strong and waited == 0.0:
                goal = 0.0 if opens else float(self.command(max(a, b)))
                change = np.clip(goal - pull[group], -self.rate * dt, self.rate * dt)
                if opens or change > 0:  # closing never gives way
                    pull[group] += change
            groups[k], pulls[k], opening[k] = group, pull, opens
        return Commands(groups, pulls, opening)

    def _near(self, x: float, y: float, group: int) -> bool:
        """Whether a point is in a group or within the margin of it."""
        width = np.pi / 2 / len(GROUPS)
        away = np.arctan2(y, x) - width * group
        return group != NO_GROUP and -self.margin < away < width + self.margin


@dataclass(frozen=True)
class Commands:
    """What the chart said.

    Attributes:
        groups: (n,) selected group, `NO_GROUP` before the first one.
        pulls: (n, 5) pull of each group [m].
        opening: (n,) whether effort opens.
    """

    groups: Index
    pulls: Array
    opening: Mask

    def fingers(self) -> Array:
        """(n, 5) pull of thumb, index, middle, ring and little finger [m]: the largest command."""
        return (self.pulls[:, None, :] * COUPLINGS).max(axis=2)


def muscle(activation: npt.ArrayLike, dt: float, rng: np.random.Generator) -> Array:
    """(n,) raw signal [1] of a muscle, noise as strong as its activation (n,), 0 to 1 [1].

    Samples are dt apart [s].
    """
    activation = np.asarray(activation, dtype=float)
    return activation * rng.normal(size=activation.shape)


def envelope(raw: npt.ArrayLike, dt: float, *, tau: float = 0.15) -> Array:
    """(n,) effort [1] from a raw signal, 1 for white noise of unit strength.

    A band from 20 to 450 Hz, rectified, smoothed with the time constant tau [s]; normalised by the
    mean of what passes the band. The raw signal (n,) is in units of its strength, its samples are
    dt apart [s].

    Raises:
        ConfigError: if samples are too far apart for the band.

    Source:
        Rectified and smoothed as in De Luca, The use of surface electromyography in biomechanics,
        J. Appl. Biomech. 13 (1997) 135.
    """
    if not 0 < dt < 1 / 950:
        raise ConfigError(f"samples {dt:g} s apart miss 450 Hz.", hint="Sample at 1 kHz.")
    b, a = butter(4, [20, 450], btype="bandpass", fs=1 / dt)
    response = lfilter(b, a, np.append(1.0, np.zeros(4095)))
    size = np.sqrt(2 / np.pi * (response @ response))
    rectified = np.abs(lfilter(b, a, np.asarray(raw, dtype=float)))
    share = dt / (tau + dt)
    return np.clip(lfilter([share], [1, share - 1], rectified) / size, 0.0, 1.0)
