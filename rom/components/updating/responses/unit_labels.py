"""Units of responses as test programs write them.

Source:
    The international yard and pound, 1959: 1 in = 0.0254 m, 1 lb = 0.45359237 kg; standard gravity
    9.80665 m/s^2 of the third general conference on weights and measures, 1901.
"""

import math
import re

from rom.errors import ConfigError

STANDARD_GRAVITY = 9.80665  # [m/s^2]
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}  # [m]
FORCES = {"n": 1.0, "kn": 1e3, "mn": 1e-3, "kgf": STANDARD_GRAVITY}
FORCES["lbf"] = 0.45359237 * STANDARD_GRAVITY
MOTIONS = {"": 8, "/s": 11, "/s^2": 12}  # types of ordinate in universal files
SPELLINGS = {"\u00b2": "^2", "\u00b5": "u", "\u03bc": "u", "**": "^", "s2": "s^2", "inch": "in"}
IN_G = ("g", "gn", "g's")
LINES = {"hz": 1.0, "khz": 1e3, "1/s": 1.0, "cps": 1.0, "rad/s": 1 / (2 * math.pi)}  # [Hz]
QUANTITIES = {"length": LENGTHS, "force": FORCES, "frequency": LINES}
NO_UNITS = ("", "none", "unknown", "unkn", "si")


def plain(text: str) -> str:
    """A unit without blanks and brackets, in one spelling."""
    text = re.sub(r"[\s()\[\]]", "", text).lower()
    for own, usual in SPELLINGS.items():
        text = text.replace(own, usual)
    return text


def in_si(text: str, quantity: str) -> float:
    """Metres, newtons or hertz of a unit of "length", "force" or "frequency"."""
    units = QUANTITIES[quantity]
    if plain(text) not in units:
        hint = f"Known are {', '.join(units)}{'; calibrate volts' * (quantity == 'force')}."
        raise ConfigError(f"the unit {text!r} is no {quantity}.", hint=hint)
    return units[plain(text)]


def motion_of_unit(text: str) -> tuple[int, float]:
    """Type of ordinate (8 displacement, 11 velocity, 12 acceleration) and factor to SI units."""
    unit = plain(text)
    if unit in IN_G:
        return 12, STANDARD_GRAVITY
    length, per, rest = unit.partition("/")
    if length in LENGTHS and per + rest in MOTIONS:
        return MOTIONS[per + rest], LENGTHS[length]
    raise ConfigError(
        f"the unit {text!r} is no motion.",
        hint=f"Known are g, and {', '.join(LENGTHS)}, each also per s and s^2; calibrate volts.",
    )


def motion_per_force(text: str) -> tuple[int, float]:
    """Type of ordinate and factor to SI units of a ratio, as (m/s^2)/N."""
    motion, slash, force = plain(text).rpartition("/")
    if not slash:
        raise ConfigError(f"the unit {text!r} must be one of a motion per force, as m/s^2/N.")
    kind, factor = motion_of_unit(motion)
    return kind, factor / in_si(force, "force")
