"""Gear meshes in mechanism files: their keys, and the records they make."""

from typing import TYPE_CHECKING, Any

from rom.arguments import Positive, Quantity, Whole
from rom.config.keys import FilePath, Flag, Key, Table
from rom.config.mechanism_keys import DIRECTION, STEEL, Markers, Section
from rom.config.mechanism_keys import RADIUS as LENGTH
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.components.gear_mesh.gears.corrections import Correction
    from rom.config.connections import Entry

TWO = ((2,),)
GEAR_PAIR = Table("A pair of involute wheels.", (
    Key("teeth", Quantity("1", TWO), "Of pinion and gear; below zero inside a ring, 0 of a rack.",
        ...),
    Key("module", LENGTH, "Normal module.", ...),
    Key("width", LENGTH, "Common width of the faces.", ...),
    Key("helix", Quantity("rad"), "At the reference circle, positive for a right-handed pinion.",
        0.0),
    Key("gear_helix", Quantity("rad"), "That of the gear, to check its hand."),
    Key("pressure_angle", Quantity("rad"), "Normal one; 20 degrees if missing."),
    Key("shift", Quantity("1", TWO), "Profile shifts in modules.", [0.0, 0.0]),
    Key("centre_distance", LENGTH, "None leaves no backlash if missing."),
    Key("thinning", Quantity("m"), "Transverse backlash from thinner teeth.", 0.0),
    Key("addendum", Positive(), "Height above the reference circle in modules.", 1.0),
    Key("dedendum", Positive(), "Depth below it in modules.", 1.25),
))  # fmt: skip
CORRECTION = Table("What is taken off the flanks, and what was measured on them.", (
    Key("relief", Quantity("m", TWO), "Depth at the tips of pinion and gear.", [0.0, 0.0]),
    Key("extent", Quantity("m", TWO), "Its length along the path of contact.", [0.0, 0.0]),
    Key("power", Positive("1"), "1 for linear, 2 for parabolic relief.", 1.0),
    Key("crowning", Quantity("m"), "At both ends of the face.", 0.0),
    Key("slope", Quantity("m"), "Of the lead over the face.", 0.0),
    Key("pinion_pitch", Quantity("m", ((None,),)), "Errors of its teeth; positive leaves a gap."),
    Key("gear_pitch", Quantity("m", ((None,),)), "Those of the gear."),
    *(Key(f"{wheel}_{kind}", FilePath(), f"Of the {which} flanks of the {wheel} [m]: a line of "
          "numbers with commas for each place of the profile, empty lines between teeth.")
      for kind, which in (("map", "working"), ("back_map", "back"))
      for wheel in ("pinion", "gear")),
    Key("run_out", Quantity("m", TWO), "By which the teeth stand off the axes.", [0.0, 0.0]),
    Key("run_out_direction", Quantity("rad", TWO), "From where the wheels mesh.", [0.0, 0.0]),
))  # fmt: skip
HERTZ = Table("Contact of teeth that gives way by its load.", (
    Key("depths", Quantity("m", (*TWO, (None, 2))), "From the flanks of pinion and gear to the "
        "axes of their teeth; one pair, or from first to last contact.", ...),
    *STEEL,
))  # fmt: skip


def gear_pair(name: str, pair: dict[str, Any]) -> Any:
    """The wheels, or pinion and rack, of the gear mesh of that name.

    Raises:
        ConfigError: for a rack with a profile shift.
    """
    from rom.components.gear_mesh.gears.geometry import GearPair
    from rom.components.gear_mesh.gears.racks import RackPair

    given: Any = {key: tuple(x) if isinstance(x, list) else x for key, x in pair.items()}
    given["teeth"] = tuple(int(z) if z.is_integer() else z for z in given["teeth"])
    if given["teeth"][1] != 0:
        return GearPair(**given)
    (pinion, _), (shift, of_rack) = given.pop("teeth"), given.pop("shift")
    if of_rack != 0.0:
        raise ConfigError(
            f"the rack of {name!r} has a profile shift of {of_rack:g}.",
            hint="Write 0 and move its reference line by centre_distance.",
        )
    return RackPair(**given, pinion_teeth=pinion, shift=shift)


def correction(values: dict[str, Any]) -> "Correction":
    """What is taken off the flanks, maps read from their files."""
    from rom.components.gear_mesh.gears.corrections import Correction, flank_map

    given = dict(values)
    for kind in ("maps", "back_maps"):
        files = [given.pop(f"{wheel}_{kind[:-1]}", None) for wheel in ("pinion", "gear")]
        given[kind] = tuple(None if path is None else flank_map(path) for path in files)
    amounts, turns = (given.pop(key, [0.0, 0.0]) for key in ("run_out", "run_out_direction"))
    given["run_out"] = tuple(zip(amounts, turns, strict=True))
    given["pitch"] = tuple(given.pop(f"{wheel}_pitch", ()) for wheel in ("pinion", "gear"))
    given |= {key: tuple(given[key]) for key in ("relief", "extent") if key in given}
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
    "gear meshes", Table("Involute teeth of two wheels in contact.", (
        Key("between", Markers(two=True), "Middle of the faces of pinion and gear.", ...),
        Key("axis", DIRECTION, "Of the pinion, in the world at the start.", ...),
        Key("pair", GEAR_PAIR, "The wheels.", ...),
        Key("stiffness", Quantity("N/m^2", ((), (None,))), "Of one pair of teeth per length of "
            "contact line; one, or from first to last contact.", ...),
        Key("correction", CORRECTION, "Of the working flanks.", {}),
        Key("damping", Quantity("s"), "Force per rate over force per deflection.", 0.0),
        Key("friction", Quantity(), "Coefficient between the flanks.", 0.0),
        Key("transition_speed", Positive("m/s"),
            "Of sliding flanks, over which friction turns."),
        Key("cells", Whole(1), "Slices across the face.", 21),
        Key("phase", Quantity("rad"), "Turn of the pinion at the start; so that teeth stand in "
            "gaps if missing."),
        Key("entry", Quantity(), "Share of the base pitch over which teeth take up load.", 0.02),
        Key("conservative", Flag(), "Whether forces follow the energy along the path of contact."),
        Key("hertz", HERTZ, "Contact that gives way by its load."),
        Key("coupling", Quantity("m"), "Length over which slices carry each other.", 0.0),
    )),
    gear_mesh,
)  # fmt: skip
