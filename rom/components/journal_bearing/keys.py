"""Journal bearings and their oil in mechanism files: their keys, and the records they make."""

from typing import TYPE_CHECKING, Any

from rom.arguments import Positive, Quantity, Whole
from rom.config.keys import Flag, Key, Named, Table, Text, Variants
from rom.config.mechanism_keys import DIRECTION, Markers, Section
from rom.config.mechanism_keys import RADIUS as LENGTH

if TYPE_CHECKING:
    from rom.components.journal_bearing.films.bearing import JournalBearing
    from rom.config.connections import Entry

OILS = {
    "constant": Table("A viscosity that stays.", (
        Key("viscosity", Positive("Pa s"), "Dynamic.", ...),
    )),
    "grade": Table("A usual mineral oil.", (
        Key("grade", Whole(1), "ISO VG 32, 46 or 68.", ...),
    )),
    "oil": Table("Any mineral oil.", (
        Key("nu_40", Positive("m^2/s"), "Kinematic at 40 degrees Celsius.", ...),
        Key("nu_100", Positive("m^2/s"), "At 100 degrees Celsius.", ...),
        Key("density", Positive("kg/m^3"), "Density.", 870.0),
        Key("heat", Positive("J/(kg K)"), "Specific heat.", 2000.0),
    )),
}  # fmt: skip
GROOVE = Table("An axial groove full of oil.", (
    Key("angle", Quantity("rad"), "Of its middle.", ...),
    Key("width", Quantity("rad"), "How far it extends around the bush.", 0.0),
    Key("pressure", Quantity("Pa"), "Of its oil.", 0.0),
    Key("share", Positive("1"), "Of the width of the bearing.", 1.0),
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


def journal_bearing(values: dict[str, Any]) -> "JournalBearing":
    """The sizes of an oil film."""
    from rom.components.journal_bearing.films.bearing import Groove, JournalBearing, multilobe

    sizes = dict(values)
    sizes["grooves"] = [Groove(**groove) for groove in sizes["grooves"].values()]
    sizes["cells"] = tuple(sizes.pop(f"cells_{axis}") for axis in ("around", "along"))
    lobes, preload, first = (sizes.pop(key) for key in ("lobes", "preload", "first_lobe"))
    sizes["bore"] = multilobe(lobes, preload, first=first) if preload else None
    return JournalBearing(**sizes)


def oil(values: dict[str, Any]) -> Any:
    """A viscosity [Pa s], or an oil."""
    from rom.components.journal_bearing.films.oil import Oil, iso_vg

    given = values | {key: 1e6 * values[key] for key in ("nu_40", "nu_100") if key in values}
    makes: dict[str, Any] = {"constant": lambda viscosity: viscosity, "grade": iso_vg, "oil": Oil}
    return makes[given.pop("kind")](**given)  # Oil takes [mm^2/s]


def add_film(entry: "Entry") -> None:
    """An oil film of an entry."""
    values = entry.values
    values |= {"bearing": journal_bearing(values["bearing"]), "oil": oil(values["oil"])}
    entry.made.journal_bearing(entry.name, *entry.ends, **values)


SECTION = Section(
    "journal bearings", Table("An oil film between journal and bush.", (
        Key("between", Markers(two=True), "On the axis of the journal, and in the middle of the "
            "bush.", ...),
        Key("axis", DIRECTION, "Of both, in the world at the start.", ...),
        Key("reference", DIRECTION, "From where angles count, across the axis; X if missing."),
        Key("bearing", JOURNAL_BEARING, "Its sizes.", ...),
        Key("oil", Variants(OILS, {"viscosity": "constant", "grade": "grade", "nu_40": "oil"}),
            "In it.", ...),
        Key("inlet", Quantity(), "Temperature of the oil that comes in [degrees Celsius]."),
        Key("roughness", Quantity("m"), "Height at which journal and bush touch.", 0.0),
        Key("carried", Quantity(), "Share of the heat that leaves with the oil.", 0.9),
        Key("felt", Quantity(), "Share of the rise that the film feels.", 0.5),
        Key("thermal_time", Positive("s"), "Over which its temperature follows.",
            1.0),
        Key("elastic_bush", Flag(), "Whether its pressure bends the bore, which has functions.",
            False),
        Key("tabulated", Flag(), "Whether it is read from a table.", False),
    )),
    add_film,
)  # fmt: skip
