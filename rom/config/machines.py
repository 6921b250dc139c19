"""Gears, bearings and their oil in a file: the keys of their sizes, and the records they make."""

from typing import TYPE_CHECKING, Any

from rom.config.keys import FilePath, Flag, Key, Named, Quantity, Table, Text, Whole
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.mbs.elements.films.bearing import JournalBearing
    from rom.mbs.elements.gears.corrections import Correction

TWO, LENGTH = ((2,),), Quantity("m", positive=True)
STEEL = (
    Key("E", Quantity("Pa", positive=True), "Young's modulus.", 206e9),
    Key("nu", Quantity(), "Poisson's ratio.", 0.3),
)
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
    Key("addendum", Quantity(positive=True), "Height above the reference circle in modules.", 1.0),
    Key("dedendum", Quantity(positive=True), "Depth below it in modules.", 1.25),
))  # fmt: skip
CORRECTION = Table("What is taken off the flanks, and what was measured on them.", (
    Key("relief", Quantity("m", TWO), "Depth at the tips of pinion and gear.", [0.0, 0.0]),
    Key("extent", Quantity("m", TWO), "Its length along the path of contact.", [0.0, 0.0]),
    Key("power", Quantity("1", positive=True), "1 for linear, 2 for parabolic relief.", 1.0),
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
OILS = {
    "constant": Table("A viscosity that stays.", (
        Key("viscosity", Quantity("Pa s", positive=True), "Dynamic.", ...),
    )),
    "grade": Table("A usual mineral oil.", (
        Key("grade", Whole(1), "ISO VG 32, 46 or 68.", ...),
    )),
    "oil": Table("Any mineral oil.", (
        Key("nu_40", Quantity("m^2/s", positive=True), "Kinematic at 40 degrees Celsius.", ...),
        Key("nu_100", Quantity("m^2/s", positive=True), "At 100 degrees Celsius.", ...),
        Key("density", Quantity("kg/m^3", positive=True), "Density.", 870.0),
        Key("heat", Quantity("J/(kg K)", positive=True), "Specific heat.", 2000.0),
    )),
}  # fmt: skip
GROOVE = Table("An axial groove full of oil.", (
    Key("angle", Quantity("rad"), "Of its middle.", ...),
    Key("width", Quantity("rad"), "How far it extends around the bush.", 0.0),
    Key("pressure", Quantity("Pa"), "Of its oil.", 0.0),
    Key("share", Quantity("1", positive=True), "Of the width of the bearing.", 1.0),
))  # fmt: skip
JOURNAL_BEARING = Table("An oil film.", (
    Key("diameter", LENGTH, "Of the journal.", ...),
    Key("length", LENGTH, "Of the bush.", ...),
    Key("clearance", LENGTH, "Radius of the bush less that of the journal.",
        ...),
    Key("grooves", Named(GROOVE, "grooves"), "Inlets of oil.", {}),
    Key("cavitation", Text(("none", "reynolds", "jfo")), "What happens where oil would have to "
        "pull: it does, it ends, it is conserved.", "reynolds"),
    Key("preload", Quantity(), "Of a lobed bore, in clearances.", 0.0),
    Key("lobes", Whole(2), "Number of arcs of such a bore.", 2),
    Key("first_lobe", Quantity("rad"), "Middle of one of them.", 0.0),
    Key("cells_around", Whole(12), "Of the film.", 120),
    Key("cells_along", Whole(2), "Of its width, or of half of it.", 8),
    Key("aligned", Flag(), "The journal never tilts: cells on half the width.", False),
))  # fmt: skip


def gear_pair(name: str, pair: dict[str, Any]) -> Any:
    """The wheels, or pinion and rack, of the gear mesh of that name.

    Raises:
        ConfigError: for a rack with a profile shift.
    """
    from rom.mbs.elements.gears.geometry import GearPair
    from rom.mbs.elements.gears.racks import RackPair

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
    from rom.mbs.elements.gears.corrections import Correction, flank_map

    given = dict(values)
    for kind in ("maps", "back_maps"):
        files = [given.pop(f"{wheel}_{kind[:-1]}", None) for wheel in ("pinion", "gear")]
        given[kind] = tuple(None if path is None else flank_map(path) for path in files)
    amounts, turns = (given.pop(key, [0.0, 0.0]) for key in ("run_out", "run_out_direction"))
    given["run_out"] = tuple(zip(amounts, turns, strict=True))
    given["pitch"] = tuple(given.pop(f"{wheel}_pitch", ()) for wheel in ("pinion", "gear"))
    given |= {key: tuple(given[key]) for key in ("relief", "extent") if key in given}
    return Correction(**given)


def rolling_bearing(values: dict[str, Any]) -> Any:
    """A row of balls or rollers."""
    from rom.mbs.elements.rolling.races import BallBearing, RollerBearing

    given: Any = {key: tuple(x) if isinstance(x, list) else x for key, x in values.items()}
    return {"balls": BallBearing, "rollers": RollerBearing}[given.pop("kind")](**given)


def journal_bearing(values: dict[str, Any]) -> "JournalBearing":
    """The sizes of an oil film."""
    from rom.mbs.elements.films.bearing import Groove, JournalBearing, multilobe

    sizes = dict(values)
    sizes["grooves"] = [Groove(**groove) for groove in sizes["grooves"].values()]
    sizes["cells"] = tuple(sizes.pop(f"cells_{axis}") for axis in ("around", "along"))
    lobes, preload, first = (sizes.pop(key) for key in ("lobes", "preload", "first_lobe"))
    sizes["bore"] = multilobe(lobes, preload, first=first) if preload else None
    return JournalBearing(**sizes)


def oil(values: dict[str, Any]) -> Any:
    """A viscosity [Pa s], or an oil."""
    from rom.mbs.elements.films.oil import Oil, iso_vg

    given = values | {key: 1e6 * values[key] for key in ("nu_40", "nu_100") if key in values}
    makes: dict[str, Any] = {"constant": lambda viscosity: viscosity, "grade": iso_vg, "oil": Oil}
    return makes[given.pop("kind")](**given)  # Oil takes [mm^2/s]
