"""Declared units. Numbers are converted at the border, never guessed."""

import math
import re
from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction
from unicodedata import normalize

from rom.errors import ConfigError
from rom.names import check_known


@dataclass(frozen=True, slots=True)
class UnitSystem:
    """A consistent system of units."""

    name: str
    length: float  # its unit [m]
    mass: float  # its unit [kg]
    time: float  # its unit [s]

    @property
    def force(self) -> float:
        """Its unit of force [N]."""
        return self.mass * self.length / self.time**2

    @property
    def pressure(self) -> float:
        """Its unit of stress [Pa]."""
        return self.force / self.length**2

    @property
    def density(self) -> float:
        """Its unit of density [kg/m^3]."""
        return self.mass / self.length**3


SYSTEMS = {
    s.name: s
    for s in (
        UnitSystem("SI", 1.0, 1.0, 1.0),
        UnitSystem("mm-t-s", 1e-3, 1e3, 1.0),  # N, MPa: the habit of Abaqus and Nastran users
        UnitSystem("mm-kg-ms", 1e-3, 1.0, 1e-3),  # kN, GPa: the habit of crash users
        UnitSystem("in-lbf-s", 0.0254, 4.4482216152605 / 0.0254, 1.0),  # psi, lbf s^2/in^4
    )
}


def unit_system(name: str) -> UnitSystem:
    """The unit system of that name.

    Raises:
        ConfigError: listing the names that exist.
    """
    known = name if isinstance(name, str) else ""
    check_known(known, SYSTEMS, f"unit system = {name!r} does not exist; known are")
    return SYSTEMS[name]


BASES = ("kg", "m", "s", "rad", "cycle")  # "cycle" keeps hertz and radians per second apart
Dimension = tuple[int, ...]
NONE: Dimension = (0, 0, 0, 0, 0)
LENGTH, TIME, ANGLE = (0, 1, 0, 0, 0), (0, 0, 1, 0, 0), (0, 0, 0, 1, 0)
MASS, FREQUENCY, SPEED = (1, 0, 0, 0, 0), (0, 0, -1, 0, 1), (0, 0, -1, 1, 0)
FORCE, PRESSURE = (1, 1, -2, 0, 0), (1, -1, -2, 0, 0)
ENERGY, POWER = (1, 2, -2, 0, 0), (1, 2, -3, 0, 0)


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: so many of the SI unit of its dimension."""

    factor: Fraction | float  # how many SI units it is [1]; a float where pi is in it
    dimension: Dimension  # (5,) exponents of `BASES`


def _family(dimension: Dimension, **factors: str) -> dict[str, Unit]:
    return {name: Unit(Fraction(factor), dimension) for name, factor in factors.items()}


UNITS = {
    **_family(MASS, kg="1", g="1e-3", mg="1e-6", t="1e3", lb="0.45359237"),
    **_family(LENGTH, m="1", km="1e3", cm="1e-2", mm="1e-3", um="1e-6", nm="1e-9"),
    "\u03bcm": Unit(Fraction("1e-6"), LENGTH),  # after normalisation, which knows one letter mu
    "\u03bcs": Unit(Fraction("1e-6"), TIME),
    **_family(LENGTH, ft="0.3048") | {"in": Unit(Fraction("0.0254"), LENGTH)},
    **_family(TIME, s="1", ms="1e-3", us="1e-6", min="60", h="3600"),
    **_family(ANGLE, rad="1", mrad="1e-3"),
    **{name: Unit(math.pi / 180, ANGLE) for name in ("deg", "°")},
    **{"rev": Unit(2 * math.pi, ANGLE), "rpm": Unit(math.pi / 30, SPEED)},
    **_family(FREQUENCY, Hz="1", kHz="1e3", MHz="1e6"),
    **_family(FORCE, N="1", mN="1e-3", kN="1e3", MN="1e6", lbf="4.4482216152605"),
    **_family(PRESSURE, Pa="1", kPa="1e3", MPa="1e6", GPa="1e9", bar="1e5", psi="6894.757293168"),
    **_family(ENERGY, J="1", kJ="1e3", Nm="1", kNm="1e3") | _family(POWER, W="1", kW="1e3"),
    **{"%": Unit(Fraction("1e-2"), NONE), "1": Unit(Fraction(1), NONE)},
}
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?")
FACTOR = re.compile(r"([A-Za-z\u03bc°%]+|1)(?:(?:\^|\*\*)?([+-]?[1-9]))?")
SUPERSCRIPTS = str.maketrans("²³⁴⁻¹", "234-1")
MAX_LETTERS = 80  # of a quantity


def unit(text: str) -> Unit:
    """A unit such as ``N``, ``kg/m^3``, ``N m/rad``, ``m s^-2``.

    Each ``/`` belongs to the one factor behind it.

    Raises:
        ConfigError: naming the part that is not understood.
    """
    factor: Fraction | float = Fraction(1)
    total = [0] * len(BASES)
    for k, part in enumerate(normalize("NFKC", text.translate(SUPERSCRIPTS)).split("/")):
        words = re.split(r"[\s·]+|(?<!\*)\*(?!\*)", part.strip())
        if k > 0 and len(words) > 1:
            raise ConfigError(f"{text!r}: several factors behind a /.", hint="As in N s/m.")
        for word in words:
            found, power = _factor(text, word)
            power = -power if k > 0 else power
            factor *= found.factor**power
            total = [a + power * b for a, b in zip(total, found.dimension, strict=True)]
    return Unit(factor, tuple(total))


def _factor(text: str, word: str) -> tuple[Unit, int]:
    match = FACTOR.fullmatch(word)
    if not match or match[1] not in UNITS:
        name = match[1] if match else word
        near = [known for known in UNITS if known.lower() == name.lower()]
        near += get_close_matches(name, UNITS, n=1, cutoff=0.5)
        hint = f"Did you mean {near[0]}?" if near else "Known are " + ", ".join(UNITS) + "."
        raise ConfigError(f"{word!r} in {text!r} is no unit.", hint=hint)
    return UNITS[match[1]], int(match[2] or 1)


def fits(given: Dimension, wanted: Dimension) -> bool:
    """Whether a dimension is the one wanted; radians may be left out beside other units."""
    if given == wanted:
        return True
    without = (*wanted[:3], 0, *wanted[4:])
    return given == without and without != NONE


def in_si(text: str, wanted: str) -> float:
    """A quantity such as ``"210 GPa"`` in units of SI, correctly rounded.

    Args:
        text: number and unit.
        wanted: a unit of the dimension it must have, e.g. ``"Pa"``; ``"1"`` for a plain number.

    Raises:
        ConfigError: if it is no quantity, or one of another dimension.
    """
    match = NUMBER.match(text.strip()) if len(text) <= MAX_LETTERS else None
    if not match:
        what = f"{text[:MAX_LETTERS]!r} does not begin with a number"
        raise ConfigError(f'{what}; write a number and its unit, as in "2.5 {wanted}".')
    symbol = text.strip()[match.end() :].strip()
    if symbol.startswith(","):
        raise ConfigError(f"{text!r}: a decimal point is needed, not a comma.")
    goal = unit(wanted)
    if not symbol and goal.dimension != NONE:
        raise ConfigError(
            f"{text!r} has no unit; {wanted} is wanted.",
            hint=f'Write "{match[0]} {wanted}", or the number without quotes for {wanted}.',
        )
    found = unit(symbol) if symbol else goal
    if not fits(found.dimension, goal.dimension):
        raise ConfigError(
            f"{text!r} is {dimension_name(found.dimension)}; {_wanted(wanted)} is wanted."
        )
    try:
        value = float(Fraction(match[0]) * found.factor)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ConfigError(f"{text!r} is too large: at most 1e308 {wanted} can be told.")
    return value


NAMES = {
    NONE: "a number", LENGTH: "a length", TIME: "a time", ANGLE: "an angle", MASS: "a mass",
    FREQUENCY: "a frequency", SPEED: "an angular speed", FORCE: "a force",
    PRESSURE: "a pressure or stress", (0, 1, -1, 0, 0): "a speed",
    (0, 1, -2, 0, 0): "an acceleration", (1, -3, 0, 0, 0): "a density",
    ENERGY: "a torque or energy", (1, 2, 0, 0, 0): "a moment of inertia",
    (1, 0, -2, 0, 0): "a stiffness", (1, 0, -1, 0, 0): "a damping",
}  # fmt: skip


def dimension_name(dimension: Dimension) -> str:
    """What a dimension is called, or its SI units."""
    if dimension in NAMES:
        return NAMES[dimension]
    powers = zip(BASES, dimension, strict=True)
    return " ".join(name if n == 1 else f"{name}^{n}" for name, n in powers if n)


def _wanted(wanted: str) -> str:
    dimension = unit(wanted).dimension
    if dimension == NONE:
        return "a number without unit"
    named = f"{NAMES[dimension]} " if dimension in NAMES else ""
    return f"{named}[{wanted}]"
