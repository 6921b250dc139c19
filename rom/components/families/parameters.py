"""Numbers of a model that may still change after its reduction.

Every parameter is a factor of the nominal material, so that one is the model as it was made.
"""

import itertools
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from rom.arguments import between, number, one_of, positive, typed
from rom.errors import ParameterError, warn
from rom.model import Array
from rom.names import check_all_known, check_text
from rom.plausible import FACTOR, warn_outside

MAX_CORNER_PARAMETERS = 3  # all corners of the range are visited up to here
MAX_PARAMETERS = 10  # of one family
RANGE_RTOL = 1e-12  # round-off by which a value may leave its range
Point = dict[str, float]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A factor of a nominal number, in one region or everywhere.

    Attributes:
        region: name of the region; None for the whole body, masses carried by interfaces excluded.
        low, high: smallest and largest factor [1].

    Raises:
        ParameterError: unless 0 < low <= high.

    Warns:
        RomWarning: for factors beyond a thousand, as when they are numbers of the material.
    """

    region: str | None
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.region is not None:
            check_text(self.region, "a region")
        low = number(f"low of {self}", self.low, error=ParameterError)
        high = number(f"high of {self}", self.high, error=ParameterError)
        if not 0.0 < low <= high:
            raise ParameterError(f"{self}: needed is 0 < low <= high, got {low:g}, {high:g}.")
        for end in dict.fromkeys((self.low, self.high)):
            warn_outside(FACTOR, end, str(self))

    def __str__(self) -> str:
        return f"{type(self).__name__} of {self.region or 'the whole body'}"

    @typed
    def inside(self, share: float) -> float:
        """The factor [1] at a share [1] of the range, 0 to 1, in equal ratios.

        Raises:
            ParameterError: for another share.
        """
        between("share", share, 0, 1, error=ParameterError)
        return float(self.low * (self.high / self.low) ** share)


class YoungsModulus(Parameter):
    """Factor of Young's modulus, Poisson's ratio kept; of all moduli of an orthotropic solid.

    Region, range and errors are as of `Parameter`.

    Example:
        >>> rom.YoungsModulus("web", low=0.5, high=2.0).high
        2.0
    """

    __slots__ = ()


class Density(Parameter):
    """Factor of the density; region, range and errors are as of `Parameter`."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Thickness(Parameter):
    """Factor of the thickness of a layer; what lies beyond it moves along.

    The plane through the origin of coordinates stays where it is.

    Attributes:
        region, low, high: see `Parameter`.
        axis: "x", "y" or "z", along which the layer is thin; no other region may lie beside it.

    Raises:
        ParameterError: as `Parameter`, or for another axis.
    """

    axis: str = "z"

    def __post_init__(self) -> None:
        Parameter.__post_init__(self)
        one_of(f"axis of {self}", self.axis, ("x", "y", "z"), error=ParameterError)


KINDS = {kind.__name__: kind for kind in (YoungsModulus, Density, Thickness)}


def checked_parameters(parameters: dict[str, Parameter]) -> dict[str, Parameter]:
    """The parameters by name, if they are such."""
    for name, value in parameters.items():
        if type(value) not in KINDS.values():
            text = f"parameter {name!r} is {value!r}; known are {sorted(KINDS)}."
            raise ParameterError(text, hint='For example rom.YoungsModulus("web", 0.5, 2.0).')
        if not str(name).isidentifier() or name == "extrapolate":
            raise ParameterError(f"{name!r} names no parameter; use letters, as in at(web=1.0).")
    if not parameters:
        raise ParameterError("a family of bodies needs a parameter.", hint="Use rom.reduce.")
    if len(parameters) > MAX_PARAMETERS:
        raise ParameterError(f"{len(parameters)} parameters must be at most {MAX_PARAMETERS}.")
    axes = {p.axis for p in parameters.values() if isinstance(p, Thickness)}
    if len(axes) > 1:
        raise ParameterError(f"thicknesses along {sorted(axes)} in one family; choose one axis.")
    return dict(parameters)


def complete(
    parameters: dict[str, Parameter], values: dict[str, float], *, extrapolate: bool = False
) -> Point:
    """Factors of all parameters, positive and within their ranges; one for those not given.

    Those outside a range are refused, or announced where one extrapolates.
    """
    check_all_known(sorted(values), parameters, "there is no parameter", ParameterError)
    each = parameters.items()
    return {name: _checked(name, p, values.get(name, 1.0), extrapolate) for name, p in each}


def _checked(name: str, parameter: Parameter, value: float, extrapolate: bool) -> float:
    positive(name, value, error=ParameterError)
    low, high = parameter.low, parameter.high
    if not low * (1 - RANGE_RTOL) <= value <= high * (1 + RANGE_RTOL):
        message = f"{name} = {value:g} is outside {low:g} to {high:g}, where the basis was made."
        if not extrapolate:
            raise ParameterError(message, hint="Reduce it wider, or ask with extrapolate=True.")
        warn(f"{message} Errors there are unknown.")
    return float(value)


def centre(parameters: dict[str, Parameter]) -> Point:
    """The middle of all ranges."""
    return {name: parameter.inside(0.5) for name, parameter in parameters.items()}


def corners(parameters: dict[str, Parameter], moving: list[str]) -> list[Point]:
    """Ends of the ranges of some parameters: all corners of a few, one at a time of many."""
    middle, ends = centre(parameters), {n: (parameters[n].low, parameters[n].high) for n in moving}
    if len(moving) <= MAX_CORNER_PARAMETERS:
        found = [dict(zip(moving, c, strict=True)) for c in itertools.product(*ends.values())]
    else:
        found = [{name: end} for name, both in ends.items() for end in both]
    return [middle | point for point in found if point]


def scattered(parameters: dict[str, Parameter], n: int, first: int = 1) -> list[Point]:
    """Points that fill the ranges evenly, the same in every run.

    Source:
        Halton, On the efficiency of certain quasi-random sequences, Numer. Math. 2 (1960) 84.
    """
    from scipy.stats.qmc import Halton  # takes a while to import

    sequence = Halton(len(parameters), scramble=False).fast_forward(first)
    each = parameters.items()
    return [
        {name: p.inside(share) for (name, p), share in zip(each, point, strict=True)}
        for point in sequence.random(n).tolist()
    ]


def factor(parameters: dict[str, Parameter], kind: type, region: str | None, point: Point) -> float:
    """Product of all factors of that kind that act on a region; None for what no region names."""
    alike = {name: p.region for name, p in parameters.items() if isinstance(p, kind)}
    return float(np.prod([point[name] for name in alike if alike[name] in (None, region)]))


def factors(
    parameters: dict[str, Parameter], regions: tuple[str | None, ...], point: Point
) -> tuple[Array, Array]:
    """Factors of the stiffness and of the mass of every region."""
    kinds = (YoungsModulus, Density)
    k, m = (np.array([factor(parameters, kind, r, point) for r in regions]) for kind in kinds)
    return k, m


def written(parameters: dict[str, Parameter]) -> dict[str, dict[str, object]]:
    """The parameters in plain numbers and words."""
    return {name: {"kind": type(p).__name__, **asdict(p)} for name, p in parameters.items()}


def read(text: dict[str, dict[str, Any]]) -> dict[str, Parameter]:
    """The parameters that were `written`."""
    fields = {name: dict(entry) for name, entry in text.items()}
    return {name: KINDS[entry.pop("kind")](**entry) for name, entry in fields.items()}
