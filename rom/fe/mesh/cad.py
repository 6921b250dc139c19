"""What the CAD knows of faces, in records: kind, radius, axis, area."""

from dataclasses import dataclass
from typing import Any, TypeVar

Vector = tuple[float, float, float]
POWERS = {"middle": 1, "point": 1, "radius": 1, "area": 2}  # of lengths


@dataclass(frozen=True, slots=True)
class Face:
    """One face of a part, as its geometry says and not as it is meshed."""

    number: int  # by which it is picked
    kind: str  # "plane", "cylinder", "cone", "sphere", "torus" or "other"
    area: float  # [m^2]
    middle: Vector  # centroid of the face, on the axis for a whole bore [m]
    # of a cylinder, a sphere or the tube of a torus [m]; None for others
    radius: float | None = None
    # unit direction of the axis of a cylinder, a cone or a torus; None for others
    axis: Vector | None = None
    # point on that axis: of a cylinder in the middle of the face, of a torus its centre, of a cone
    # in the middle of its parameters; centre of a sphere [m]
    point: Vector | None = None
    normal: Vector | None = None  # unit outward normal of a plane; None for others
    name: str = ""  # of the interface it belongs to; empty for none


@dataclass(frozen=True, slots=True)
class Axis:
    """Common axis of the cylinder faces of an interface."""

    point: Vector  # on the axis, in the middle of the faces along it [m]
    direction: Vector  # unit vector; its largest component is positive
    radius: float | None  # [m]; None where the faces have several


Record = TypeVar("Record", Face, Axis)


def from_plain(kind: type[Record], values: dict[str, Any], scale: float) -> Record:
    """A record from what `dataclasses.asdict` and JSON made of it, all lengths multiplied."""

    def sized(name: str, value: Any) -> Any:
        if isinstance(value, list):
            return tuple(sized(name, x) for x in value)
        return value if value is None or name not in POWERS else value * scale ** POWERS[name]

    return kind(**{name: sized(name, value) for name, value in values.items()})
