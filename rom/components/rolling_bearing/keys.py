"""Rolling bearings in mechanism files: their keys, and the records they make."""

from typing import TYPE_CHECKING, Any

from rom.arguments import Quantity, Whole
from rom.config.keys import Key, Table, Variants
from rom.config.mechanism_keys import AXIS, BETWEEN, STEEL, Section
from rom.config.mechanism_keys import RADIUS as LENGTH

if TYPE_CHECKING:
    from rom.config.connections import Entry

TWO = ((2,),)
ROLLING = {
    "balls": Table("A row of balls.", (
        Key("balls", Whole(3), "Number.", ...),
        Key("ball_diameter", LENGTH, "Of a ball.", ...),
        Key("pitch_diameter", LENGTH, "Of the circle of balls.", ...),
        Key("conformity", Quantity("1", TWO), "Radius of the grooves of inner and outer race over "
            "the diameter of the ball.", [0.52, 0.52]),
        Key("contact_angle", Quantity("rad"), "Without load.", 0.0),
        Key("clearance", Quantity("m"), "Radial play; negative for one that is pressed.", 0.0),
        *STEEL,
    )),
    "rollers": Table("A row of cylindrical steel rollers.", (
        Key("rollers", Whole(3), "Number.", ...),
        Key("roller_diameter", LENGTH, "Of a roller.", ...),
        Key("length", LENGTH, "Of a roller.", ...),
        Key("pitch_diameter", LENGTH, "Of the circle of rollers.", ...),
        Key("clearance", Quantity("m"), "Radial play; negative for one that is pressed.", 0.0),
    )),
}  # fmt: skip
ROLLING_KEYS = (
    BETWEEN, AXIS,
    Key("damping", Quantity("s/m"), "Force on a ball grows by this factor of its speed.", 0.0),
    Key("phase", Quantity("rad"), "Angle of the first one.", 0.0),
)  # fmt: skip


def rolling_bearing(values: dict[str, Any]) -> Any:
    """A row of balls or rollers."""
    from rom.components.rolling_bearing.races import BallBearing, RollerBearing

    given: Any = {key: tuple(x) if isinstance(x, list) else x for key, x in values.items()}
    return {"balls": BallBearing, "rollers": RollerBearing}[given.pop("kind")](**given)


def add_bearing(entry: "Entry") -> None:
    """A rolling bearing of an entry."""
    how = {key: entry.values.pop(key) for key in ("axis", "damping", "phase")}
    bearing = rolling_bearing(entry.values)
    entry.made.rolling_bearing(entry.name, *entry.ends, bearing=bearing, **how)


SECTION = Section(
    "rolling bearings", Variants({
        kind: Table(table.about, (*ROLLING_KEYS, *table.keys)) for kind, table in ROLLING.items()
    }, {kind: kind for kind in ROLLING}),
    add_bearing,
)  # fmt: skip
