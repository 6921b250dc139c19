"""How numbers are read off a picture: prefixes of units, round lengths, and what is round-off."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rom.model import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROUND_OFF = 1e-9  # of the largest value of a panel; what varies by less is drawn as constant
PREFIXES = {9: "G", 6: "M", 3: "k", 0: "", -3: "m", -6: "µ", -9: "n", -12: "p"}
LARGEST_POWERS = {"s": 0, "m": 3, "rad": 0}  # nobody reads kiloseconds
UNIT_PATTERN = re.compile(r"(m|Pa|N|Hz|s|W|J|rad)(?=$|[ /])")
LABEL_PATTERN = re.compile(r"((?!.*\blog)[^\[\]]*)\[([^\[\]]+)\]\s*")  # no logarithm of a quantity
DEGREES = (0.1, 3600.0)  # sizes of angles that are read in degrees


def prefixed(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which a size is read off: between 1 and 1000, angles in degrees.

    Units are m, Pa, N, Hz, s, W, J or rad, or products and quotients that begin with one of them;
    others stay as they are, and so do units that have a prefix already.
    """
    found = UNIT_PATTERN.match(unit)
    if not found or not 0.0 < size < np.inf:
        return 1.0, unit
    if unit == "rad" and DEGREES[0] <= np.rad2deg(size) <= DEGREES[1]:
        return float(np.rad2deg(1.0)), "deg"
    power = 3 * int(np.floor(np.log10(size) / 3 + 1e-12))
    power = min(max(power, min(PREFIXES)), LARGEST_POWERS.get(found[1], max(PREFIXES)))
    return 10.0**-power, PREFIXES[power] + unit


def written(size: float, unit: str) -> str:
    """A size with its unit, for people: four digits and a prefix."""
    factor, unit = prefixed(abs(size), unit)
    return f"{factor * size:.4g} {unit}"


def clock_texts(times: Array) -> list[str]:
    """Times (n,) [s] for the pictures of a film, all in one unit and with as many digits."""
    size, span = float(np.abs(times).max()), float(np.ptp(times))
    factor, unit = prefixed(size, "s")
    digits = max(0, 3 - int(np.floor(np.log10(factor * (span or size or 1.0)))))
    return [f"t = {factor * t:.{min(digits, 6)}f} {unit}" for t in times]


def round_length(largest: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above a length."""
    power = 10.0 ** np.floor(np.log10(largest))
    return float(max(d * power for d in (1, 2, 5) if d * power <= largest * (1 + 1e-12)))


def without_round_off(curves: Sequence[Array]) -> list[Array]:
    """The curves (n,) of one panel and unit, made constant where they vary by round-off alone."""
    seen = [y[np.isfinite(y)] for y in curves]
    every = np.concatenate([*seen, np.zeros(0)])
    limit = ROUND_OFF * np.abs(every).max(initial=0.0)
    if every.size and np.ptp(every) <= limit:  # all of them are one constant
        return [np.where(np.isfinite(y), np.median(every), y) for y in curves]
    flat = list(curves)
    for k, known in enumerate(seen):
        if known.size and np.ptp(known) <= limit:
            middle = np.median(known) if abs(np.median(known)) > limit else 0.0
            flat[k] = np.where(np.isfinite(flat[k]), middle, flat[k])
    return flat


def readable(axes: "Axes", *, alike: bool = False) -> None:
    """Ticks and labels of linear axes in prefixed units, where a label ends with "[unit]".

    What is drawn stays in the unit of the label, so that more can be added in the same. Axes that
    are alike have one scale, and so one unit.
    """
    sizes = [float(np.abs(axis.get_view_interval()).max()) for axis in (axes.xaxis, axes.yaxis)]
    for axis, size in zip((axes.xaxis, axes.yaxis), sizes, strict=True):
        found = LABEL_PATTERN.fullmatch(axis.get_label_text())
        if not found or axis.get_scale() != "linear":
            continue
        factor, unit = prefixed(max(sizes) if alike else size, found[2])
        if unit != found[2]:
            from rom.view.canvas.picture import ScaledPlaces, ScaledTicks

            axis.set_major_locator(ScaledPlaces(factor))
            axis.set_major_formatter(ScaledTicks(factor))
            axis.set_label_text(f"{found[1]}[{unit}]")
