"""Numbers as signatures declare them: unit, shapes and limits, once for all who ask.

``stiffness: Annotated[float, Positive("N/m")]`` is checked at each call, see
`rom.arguments.border`, and is a key of that unit in files, see `rom.config.keys`. A number that may
be missing is ``Annotated[float, Positive("m")] | None``.
"""

import math
import reprlib
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from rom.errors import ConfigError, ModelError, RomError

Shape = tuple[int | None, ...]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with a unit, or an array of them."""

    unit: str = "1"  # in SI
    shapes: tuple[Shape, ...] = ((),)  # None in one for any length
    low: float = -math.inf
    high: float = math.inf
    ends: str = "()"  # square ones where a limit itself is allowed
    error: type[RomError] = ConfigError  # of what a call raises for a number beyond the limits
    infinite: bool = False  # whether it may be infinite, beside finite numbers
    ascending: int = 0  # how many numbers a list has at least, each above the one before

    @property
    def summary(self) -> str:
        """Number, vector or matrix, with unit and limits."""
        forms = {0: "number", 1: "list", 2: "matrix"}
        sizes = ["x".join("n" if n is None else str(n) for n in s) for s in self.shapes]
        shapes = zip(self.shapes, sizes, strict=True)
        words = [f"{forms[len(s)]} {size}".strip() for s, size in shapes]
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        limits = self.must.replace("must not be", "not").removeprefix("must be ")
        return " or ".join(words) + unit + (f", {limits}" if limits else "")

    @property
    def must(self) -> str:
        """What the limits ask for, as the rest of a sentence."""
        if self.ascending:
            return f"must be {self.ascending} or more numbers that ascend"
        if (self.low, self.high) == (0.0, math.inf):
            sign = "must not be negative" if self.ends[0] == "[" else "must be positive"
            return sign + " or infinite" * self.infinite
        low = f"{'at least' if self.ends[0] == '[' else 'above'} {self.low:.6g}"
        high = f"{'at most' if self.ends[1] == ']' else 'below'} {self.high:.6g}"
        words = [low] * math.isfinite(self.low) + [high] * math.isfinite(self.high)
        return f"must be {' and '.join(words)}" if words else ""

    def holds(self, x: float) -> bool:
        """Whether a number is within the limits."""
        above = x >= self.low if self.ends[0] == "[" else x > self.low
        below = x <= self.high if self.ends[1] == "]" else x < self.high
        return above and (below or (self.infinite and x == math.inf))

    def has_shape(self, found: tuple[int, ...]) -> bool:
        """Whether that is one of the shapes."""
        return any(
            len(found) == len(shape)
            and all(n in (None, m) for n, m in zip(shape, found, strict=True))
            for shape in self.shapes
        )

    def fault(self, value: Any) -> str:
        """What is wrong with finite numbers, to be said behind their name; nothing if they fit."""
        array = np.asarray(value, dtype=float)
        if not self.has_shape(array.shape):
            shapes = " or ".join(str(shape).replace("None", "n") for shape in self.shapes)
            return f" has shape {array.shape}, needed is {shapes}."
        if array.size < self.ascending or (self.ascending and not (np.diff(array) > 0).all()):
            return f" = {reprlib.repr(array.tolist())} {self.must}."
        if not array.size or (self.holds(array.min()) and self.holds(array.max())):
            return ""
        wrong = next(x for x in array.flat if not self.holds(x))
        return f" = {wrong:g} {self.must}."


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number within limits, None for no upper one; beyond them a call raises the error."""

    least: int = 0
    most: int | None = None
    error: type[RomError] = ConfigError

    @property
    def summary(self) -> str:
        """Whole number from the least one on."""
        return f"whole number from {self.least}"

    @property
    def words(self) -> str:
        """What it must be."""
        span = f"of {self.least} or more" if self.most is None else f"from {self.least} to "
        return f"a whole number {span}{'' if self.most is None else self.most}"

    def holds(self, n: int) -> bool:
        """Whether a number is within the limits."""
        return self.least <= n and (self.most is None or n <= self.most)

    def fault(self, value: int) -> str:
        """What is wrong with a whole number; nothing if it fits."""
        return "" if self.holds(value) else f" = {value} must be {self.words}."


def Number(unit: str = "1", *shapes: Shape) -> Quantity:
    """Any number."""
    return Quantity(unit, shapes or ((),))


def Positive(
    unit: str = "1", *shapes: Shape, error: type[RomError] = ConfigError, infinite: bool = False
) -> Quantity:
    """Above zero."""
    return Quantity(unit, shapes or ((),), 0.0, error=error, infinite=infinite)


def NotNegative(
    unit: str = "1", *shapes: Shape, error: type[RomError] = ConfigError, infinite: bool = False
) -> Quantity:
    """Zero or more."""
    return Quantity(unit, shapes or ((),), 0.0, ends="[)", error=error, infinite=infinite)


def Ascending(unit: str = "1", least: int = 2) -> Quantity:
    """So many numbers or more, each above the one before."""
    return Quantity(unit, ((None,),), ascending=least)


def AtLeast(low: float, unit: str = "1") -> Quantity:
    """From a number on."""
    return Quantity(unit, ((),), low, ends="[)")


def Between(
    low: float,
    high: float,
    ends: str = "[]",
    unit: str = "1",
    *,
    error: type[RomError] = ConfigError,
) -> Quantity:
    """Within an interval, round brackets where an end is no part of it."""
    return Quantity(unit, ((),), low, high, ends, error)


Count = Whole  # a whole number of so many or more
Length = Annotated[float, Positive("m")]
Size = Annotated[float, Positive("m", error=ModelError)]  # of a part that cannot be without it
Angle = Annotated[float, Number("rad")]
Modes = Annotated[int, Count()]  # their number
Share = Annotated[float, Between(0.0, 1.0)]
Point = Annotated[npt.ArrayLike, Number("m", (3,))]
Direction = Annotated[npt.ArrayLike, Number("1", (3,))]
Orientation = Annotated[npt.ArrayLike, Number("1", (3, 3), (4,))]
Velocity = Annotated[npt.ArrayLike, Number("m/s", (3,))]
Omega = Annotated[npt.ArrayLike, Number("rad/s", (3,))]
