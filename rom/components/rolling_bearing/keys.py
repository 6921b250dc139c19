"""Rolling bearings in mechanism files: their keys, and the records they make."""

from typing import TYPE_CHECKING

from rom.config.declared import Declared
from rom.config.keys import Variants
from rom.config.mechanism_keys import BETWEEN, Section
from rom.fields import follow

if TYPE_CHECKING:
    from rom.config.connections import Entry

RACES_MODULE = "rom.components.rolling_bearing.races"
ROWS = {"balls": f"{RACES_MODULE}:BallBearing", "rollers": f"{RACES_MODULE}:RollerBearing"}


def add_bearing(entry: "Entry") -> None:
    """A rolling bearing of an entry."""
    bearing = entry.take(follow(ROWS[entry.values.pop("kind")]))
    entry.made.rolling_bearing(entry.name, *entry.ends, bearing=bearing, **entry.values)


SECTION = Section(
    "rolling bearings",
    Variants(
        {
            kind: Declared(f"{row} rolling_bearing", BETWEEN, without="bearing")
            for kind, row in ROWS.items()
        },
        {kind: kind for kind in ROWS},
    ),
    add_bearing,
)
