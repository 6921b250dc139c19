"""Numbers that are legal, but that no machine has: said with the number, where they come in.

A wrong unit is nearly always wrong by a factor of 100 or more. The limits lie that far outside
what is built, so that nobody is blamed who means what he writes.
"""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

from rom.errors import ConfigError, warn


@dataclass(frozen=True, slots=True)
class Range:
    """What a quantity is in machines, buildings and instruments."""

    quantity: str  # its name in a sentence
    low: float | None  # None for no limit
    high: float | None
    unit: str  # in SI; empty for a plain number
    known: str  # what lies at the limits
    cure: str  # what to look at; if empty, the unit that the value seems to have

    def includes(self, value: float) -> bool:
        """Whether the value lies inside."""
        low = -math.inf if self.low is None else self.low
        return low <= value <= (math.inf if self.high is None else self.high)

    def doubt(self, value: float, of: str = "") -> str:
        """A sentence if the value lies outside, else nothing."""
        if self.includes(value):
            return ""
        name = f"{self.quantity} of {of}" if of else self.quantity
        unit = f" {self.unit}" if self.unit else ""
        return f"{name} is {value:.4g}{unit}; {self.known}. {self.cure or self._slip(value)}"

    def _slip(self, value: float) -> str:
        """The unit in which the value would be usual."""
        for word, factor in SLIPS.get(self.unit, ()):
            if self.includes(meant := value * factor):
                return f"It looks like {word}: {value:.4g} {word} are {meant:.4g} {self.unit}."
        return f"It is in {self.unit}."


SOUND = "the speed of sound sqrt(E/rho)"
ALL_SOLIDS = "solids have 10 m/s (soft foam) to 20000 m/s (diamond)"
E_AND_RHO = "Check the units: E in Pa, rho in kg/m^3."
WAVE_SPEED = Range(SOUND, 10.0, 2.0e4, "m/s", ALL_SOLIDS, E_AND_RHO)
ESTIMATED = "the speed of sound, estimated from stiffness and mass at the nodes,"
OF_NODES = "Check units='...' of the matrices and nodes."
MATRIX_SPEED = Range(ESTIMATED, 7.0, 3.0e4, "m/s", ALL_SOLIDS, OF_NODES)
FOAM_SPEED = 1000.0  # m/s; no foam is faster
LIGHT_SPEED = 100.0  # m/s; nothing lighter than honeycomb is faster
HEAVY_DENSITY = 5000.0  # kg/m^3; beyond are metals, the slowest of them lead with 1190 m/s
HEAVY_SPEED = Range(
    SOUND, 600.0, 2.0e4, "m/s", "solids as heavy have 1190 m/s (lead) to 7000 (ceramics)", E_AND_RHO
)
SOLID_DENSITY = Range(
    "the density", 0.1, 3.0e4, "kg/m^3", "solids have 0.1 (aerogel) to 22600 (osmium)", E_AND_RHO
)
STIFF_DENSITY = Range(
    "the density", 10.0, 3.0e4, "kg/m^3", "solids as stiff have 10 (honeycomb) to 22600", E_AND_RHO
)
FACTOR = Range(
    "the factor", 1e-3, 1e3, "", "one is the model as made", "Give factors, not the number itself."
)
SIZE = Range(
    "the size", 1e-6, 1e4, "m", "bodies have 1e-06 m to 10000 m", "For millimetres, scale=1e-3."
)
OF_BOX = "the mass over the volume of the bounding box"
OSMIUM = "no solid is denser than 22600 kg/m^3 (osmium)"
DENSITY = Range(OF_BOX, None, 3.0e4, "kg/m^3", OSMIUM, "Check the units of mass and coordinates.")
GRAVITY = Range(
    "gravity", None, 100.0, "m/s^2", "earth has 9.81, Jupiter 25", "9810 belongs to millimetres."
)
STRUCTURES = "metal has 0.0005 to 0.01, bolted structures up to 0.1, rubber up to 0.3"
PER_CENT = "One is critical damping: write two per cent as 0.02."
DAMPING_RATIO = Range("the damping ratio", None, 0.3, "", STRUCTURES, PER_CENT)
OF_MARKERS = "the radius of gyration over the reach of the markers"
REACHING = "a body reaches as far as its mass"
GYRATION = Range(OF_MARKERS, None, 100.0, "", REACHING, "Check the unit of the inertia: kg m^2.")
ANGLES = "Thirty per cent are 0.3, an angle of 35 degrees is 0.7."
FRICTION = Range("the coefficient of friction", None, 3.0, "", "rubber on rock reaches 2", ANGLES)
SPEED = Range(
    "the speed at the start", None, 1e5, "m/s", "spacecraft reach 70000 m/s", "Check the unit: m/s."
)
OF_MODEL = "the reach of its mass over the size of the model"
CARRIED = "what an interface carries is not so much larger"
REACH = Range(OF_MODEL, None, 100.0, "", CARRIED, "Check the units: inertia in kg m^2, at in m.")
SIGN = "Check the sign."
STIFFNESS = Range("the stiffness", 0.0, None, "", "below zero it pushes from where it rests", SIGN)
DAMPING = Range("the damping", 0.0, None, "", "below zero it gives energy to the motion", SIGN)


SLIPS = {  # units that stand for others by mistake, and what they are
    "m": (("mm", 1e-3), ("micrometres", 1e-6)),
    "rad": (("degrees", math.pi / 180),),
    "Pa": (("bar", 1e5), ("MPa", 1e6), ("GPa", 1e9)),
    "Pa s": (("mPa s", 1e-3),),
    "N/m^2": (("N/(mm um)", 1e9),),
    "kg/m^3": (("g/cm^3", 1e3),),
    "J/(kg K)": (("kJ/(kg K)", 1e3),),
}
TURN = 2 * math.pi
# what arguments of public functions and records of components are, by their name, or where the
# name has other meanings elsewhere, by whose it is: limits, unit, what there is. Zero is for none
_OIL = 1e-6, 10.0, "Pa s", "oils have 0.002 to 2, air 2e-05"
_STEEL = 3e8, 2e12, "Pa", "machine parts have 1e9 (plastics) to 1e12"
_BALL = 1e-5, 1.0, "m", "bearings and springs have 0.0001 m to 0.2 m"
_FACE = 1e-5, 5.0, "m", "gears have 0.0001 m to 1 m"
_JOURNAL = 1e-4, 10.0, "m", "journals have 0.001 m to 1.5 m"
_ANGLE = -2 * TURN, 2 * TURN, "rad", "a whole turn has 6.283 rad"
_LIMITS: dict[str, tuple[float, float, str, str]] = {
    "module": (1e-5, 0.2, "m", "gears have 5e-05 m (watches) to 0.1 m"),
    "clearance": (-0.01, 0.02, "m", "bearings have 1e-06 m to 0.001 m"),
    "Groove.pressure": (1e3, 1e8, "Pa", "oil comes in at 1e4 to 1e7"),
    "Oil.density": (300.0, 3000.0, "kg/m^3", "oils have 700 to 1100"),
    "Oil.heat": (500.0, 1e4, "J/(kg K)", "oils have 1600 to 2500"),
    "inlet": (-60.0, 200.0, "degrees Celsius", "oil comes in at 20 to 90, in K 273 more"),
    "pitch_diameter": (1e-4, 20.0, "m", "bearings have 0.002 m to 10 m"),
    **dict.fromkeys(("oil", "viscosity"), _OIL),
    **dict.fromkeys(("BallBearing.E", "Hertz.E", "HelicalSpring.E"), _STEEL),
    **dict.fromkeys(("ball_diameter", "roller_diameter", "wire"), _BALL),
    **dict.fromkeys(("GearPair.width", "RackPair.width", "gear.width"), _FACE),
    **dict.fromkeys(("JournalBearing.diameter", "JournalBearing.length"), _JOURNAL),
    **dict.fromkeys(("lobes", "helix", "gear_helix", "pressure_angle", "contact_angle"), _ANGLE),
    **dict.fromkeys(("cone", "tilt", "yaw", "half_angle", "Groove.angle", "Groove.width"), _ANGLE),
}
USUAL = {"friction": FRICTION, "mu": FRICTION} | {
    name: Range(repr(name.split(".")[-1]), *limits, "") for name, limits in _LIMITS.items()
}

MAX_ORIGIN_RATIO = 100.0  # sizes from the origin: four of sixteen digits of an inertia cancel
SCALED_RATIO = 100.0  # times a default, from where a value has another unit


def far_doubt(distance: float, size: float, of: str) -> str:
    """A sentence if a body lies so far from the origin that digits cancel, else nothing."""
    if distance <= MAX_ORIGIN_RATIO * size:
        return ""
    ratio = distance / size if size > 0.0 else math.inf
    lost = min(2 * math.log10(ratio), 16.0)
    return (
        f"{of} lies {distance:.4g} m from the origin, {ratio:.3g} times its size {size:.4g} m: "
        f"about {lost:.0f} of 16 digits of its inertia and frame cancel. Move the geometry to the "
        "origin and place the body with at=."
    )


def scaled_doubt(name: str, value: Any, default: Any) -> str:
    """A sentence if a length or count is out of all proportion to its default, else nothing."""
    usual = all(isinstance(x, Real) and not isinstance(x, bool) and x for x in (value, default))
    if not usual or 1 / SCALED_RATIO <= abs(value / default) <= SCALED_RATIO:
        return ""
    return (
        f"parameter {name} = {value:g} is {abs(value / default):.3g} times its default "
        f"{default:g}. Check its unit: lengths are in m."
    )


def warn_outside(limits: Range, value: float, of: str = "") -> None:
    """Warn if a value lies outside its range."""
    warn(limits.doubt(value, of))


def check_damping_ratio(ratio: float, of: str = "", *, stilled: bool = False) -> None:
    """Take a share of critical damping at the border; warn of one that no structure has.

    Stilled takes one at its word: so are residual shapes stilled.
    """
    name = f"the damping ratio of {of}" if of else "damping ratio"
    if isinstance(ratio, bool) or not isinstance(ratio, Real) or not math.isfinite(ratio):
        raise ConfigError(f"{name} = {ratio!r} must be a finite number.")
    if ratio < 0.0:
        raise ConfigError(f"{name} = {ratio:g} is negative: it must be >= 0, not to drive.")
    if ratio > 1.0:
        raise ConfigError(
            f"{name} = {ratio:g} is beyond critical damping (1): nothing would vibrate.",
            hint=f"For {ratio:g} per cent write {ratio / 100:g}; to damp beyond one on purpose, "
            "use Rayleigh.",
        )
    if ratio < 1.0 or not stilled:
        warn_outside(DAMPING_RATIO, ratio, of)
