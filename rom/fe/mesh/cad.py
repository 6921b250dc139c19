"""What the CAD knows of faces, in records: kind, radius, axis, area."""

from dataclasses import dataclass, replace
from typing import Any, TypeVar

Vector = tuple[float, float, float]
LENGTHS = ("middle", "point", "radius")


@dataclass(frozen=True, slots=True)
class Face:
    """One face of a part, as its geometry says and not as it is meshed.

    Attributes:
        number: by which it is picked.
        kind: "plane", "cylinder", "cone", "sphere", "torus" or "other".
        area: [m^2].
        middle: centroid of the face, on the axis for a whole bore [m].
        radius: of a cylinder, a sphere or the tube of a torus [m]; None for others.
        axis: unit direction of the axis of a cylinder, a cone or a torus; None for others.
        point: point on that axis: of a cylinder in the middle of the face, of a torus its centre,
            of a cone in the middle of its parameters; centre of a sphere [m].
        normal: unit outward normal of a plane; None for others.
        name: of the interface it belongs to; empty for none.
    """

    number: int
    kind: str
    area: float
    middle: Vector
    radius: float | None = None
    axis: Vector | None = None
    point: Vector | None = None
    normal: Vector | None = None
    name: str = ""


@dataclass(frozen=True, slots=True)
class Axis:
    """Common axis of the cylinder faces of an interface.

    Attributes:
        point: on the axis, in the middle of the faces along it [m].
        direction: unit vector; its largest component is positive.
        radius: [m]; None where the faces have several.
    """

    point: Vector
    direction: Vector
    radius: float | None


Record = TypeVar("Record", Face, Axis)


def scaled(record: Record, scale: float) -> Record:
    """The same with all lengths multiplied."""
    changes: dict[str, Any] = {}
    for name in LENGTHS:
        value = getattr(record, name, None)
        if value is not None:
            along = isinstance(value, tuple)
            changes[name] = tuple(scale * x for x in value) if along else scale * value
    if isinstance(record, Face):
        changes["area"] = record.area * scale**2
    return replace(record, **changes)


def from_plain(kind: type[Record], values: dict[str, Any]) -> Record:
    """A record from what `dataclasses.asdict` and JSON made of it."""
    known: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
    return kind(**known)
