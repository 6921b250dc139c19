"""Gear meshes in mechanism files: their keys, and the records they make."""

from typing import TYPE_CHECKING, Any

from rom.arguments import Positive, Quantity
from rom.config.declared import Declared
from rom.config.keys import Key, file_path
from rom.config.mechanism_keys import Markers, Section
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.components.gear_mesh.gears.corrections import Correction
    from rom.components.gear_mesh.gears.geometry import GearPair
    from rom.components.gear_mesh.gears.racks import RackPair
    from rom.config.connections import Entry

Values = dict[str, Any]  # of the keys of an entry
GEARS_MODULE = "rom.components.gear_mesh.gears"
TWO = ((2,),)
GEAR_PAIR = Declared(
    f"{GEARS_MODULE}.geometry:GearPair", without="fillet", addendum=Positive(), dedendum=Positive()
)
LINES = "[m]: a line of numbers with commas per place of the profile, empty lines between teeth."
MAPS = [
    Key(f"{wheel}_{kind}", file_path, f"Of the {which} flanks of the {wheel} {LINES}")
    for kind, which in (("map", "working"), ("back_map", "back"))
    for wheel in ("pinion", "gear")
]
CORRECTION = Declared(
    f"{GEARS_MODULE}.corrections:Correction",
    Key("pinion_pitch", Quantity("m", ((None,),)), "Errors of its teeth; positive leaves a gap."),
    Key("gear_pitch", Quantity("m", ((None,),)), "Those of the gear."),
    *MAPS,
    Key("run_out", Quantity("m", TWO), "By which the teeth stand off the axes.", [0.0, 0.0]),
    Key("run_out_direction", Quantity("rad", TWO), "From where the wheels mesh.", [0.0, 0.0]),
    about="What is taken off the flanks, and what was measured on them.",
    without="pitch maps back_maps",
)


def gear_pair(name: str, pair: Values) -> "GearPair | RackPair":
    """The wheels, or pinion and rack, of the gear mesh of that name."""
    from rom.components.gear_mesh.gears.geometry import GearPair
    from rom.components.gear_mesh.gears.racks import RackPair

    given = dict(pair)
    given["teeth"] = tuple(int(z) if z.is_integer() else z for z in given["teeth"])
    if given["teeth"][1] != 0:
        return GearPair(**given)
    (pinion, _), (shift, of_rack) = given.pop("teeth"), given.pop("shift")
    if of_rack != 0.0:
        text = f"the rack of {name!r} has a profile shift of {of_rack:g}"
        raise ConfigError(f"{text}; write 0 and move its reference line by centre_distance.")
    return RackPair(**given, pinion_teeth=pinion, shift=shift)


def correction(values: Values) -> "Correction":
    """What is taken off the flanks, maps read from their files."""
    from rom.components.gear_mesh.gears.corrections import Correction, flank_map

    given = dict(values)
    for kind in ("maps", "back_maps"):
        files = [given.pop(f"{wheel}_{kind[:-1]}", None) for wheel in ("pinion", "gear")]
        given[kind] = tuple(None if path is None else flank_map(path) for path in files)
    amounts, turns = (given.pop(key, [0.0, 0.0]) for key in ("run_out", "run_out_direction"))
    given["run_out"] = tuple(zip(amounts, turns, strict=True))
    given["pitch"] = tuple(given.pop(f"{wheel}_pitch", ()) for wheel in ("pinion", "gear"))
    return Correction(**given)


def gear_mesh(entry: "Entry") -> None:
    """A gear mesh of an entry."""
    from rom.components.gear_mesh.gears.hertz import Hertz

    values = entry.values
    values["pair"] = gear_pair(entry.name, values["pair"])
    values["correction"] = correction(values["correction"])
    if "hertz" in values:
        values["hertz"] = Hertz(**values["hertz"])
    entry.made.gear_mesh(entry.name, *entry.ends, **values)


SECTION = Section(
    "gear meshes",
    Declared(
        "gear_mesh",
        Key("between", Markers(two=True), "Middle of the faces of pinion and gear.", ...),
        Key("pair", GEAR_PAIR, "The wheels.", ...),
        Key("correction", CORRECTION, "Of the working flanks.", {}),
    ),
    gear_mesh,
)
