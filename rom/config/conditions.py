"""Events in a file: what is measured, and the value that it passes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rom.config.keys import Place

if TYPE_CHECKING:
    from rom.mbs.elements.formulas.programs import Formula
    from rom.mbs.integrate.events import Instant

Measured = tuple[float, float]  # value and rate


@dataclass(frozen=True)
class Condition:
    """A measured value x with its rate v, and what of it must be zero.

    Attributes:
        kind: "coordinate", "position" or "distance".
        follow: the joint with its coordinate, or the markers.
        axis: (3,) unit vector, for a position.
        value: that x passes.
        formula: of t, x and v, in place of a value.
    """

    kind: str
    follow: tuple[Any, ...]
    axis: Any
    value: float
    formula: "Formula | None"

    def __call__(self, t: float, instant: "Instant") -> float:
        """What passes through zero."""
        x, v = getattr(self, self.kind)(instant)
        return x - self.value if self.formula is None else self.formula(t, x, v)

    def coordinate(self, instant: "Instant") -> Measured:
        """Of a joint."""
        (joint,) = self.follow
        return instant.joint(joint) if isinstance(joint, str) else instant.joint(*joint)

    def position(self, instant: "Instant") -> Measured:
        """Of a marker along the axis."""
        (marker,) = self.follow
        place = instant.position(marker.body, marker)
        return float(self.axis @ place), float(self.axis @ instant.velocity(marker.body, marker))

    def distance(self, instant: "Instant") -> Measured:
        """Of two markers."""
        import numpy as np

        one, two = self.follow
        gap = instant.position(two.body, two) - instant.position(one.body, one)
        slide = instant.velocity(two.body, two) - instant.velocity(one.body, one)
        x = float(np.linalg.norm(gap))
        return x, float(gap @ slide) / x if x > 0.0 else 0.0


def condition_of(ends: list[Any], values: dict[str, Any], place: Place) -> Condition:
    """The condition of an entry of [events].

    Raises:
        ConfigError: for a value and a formula, or neither; or an axis of length zero.
    """
    if ("value" in values) == ("expression" in values):
        what = "both a value and an expression" if "value" in values else "no value it passes"
        raise place.error(f"{place.name} has {what}.", "Give one of value and expression.")
    follow: tuple[Any, ...] = tuple(ends)
    if "coordinate" in values:
        follow = ((ends[0], values["coordinate"]),)
    axis = None
    if "axis" in values:
        from rom.arguments import unit_vector

        axis = unit_vector(f"axis of {place.path[-1]}", values["axis"])
    formula = None
    if "expression" in values:
        from rom.mbs.elements.formulas.programs import formula as made

        formula = made(values["expression"])
    return Condition(values["kind"], follow, axis, values.get("value", 0.0), formula)
