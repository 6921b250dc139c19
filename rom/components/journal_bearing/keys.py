"""Journal bearings and their oil in mechanism files: their keys, and the records they make."""

from typing import TYPE_CHECKING, Any

from rom.arguments import Positive, Quantity, Whole
from rom.config.declared import Declared
from rom.config.keys import Key, Named, Table, Variants
from rom.config.mechanism_keys import Markers, Section

if TYPE_CHECKING:
    from rom.components.journal_bearing.films.bearing import JournalBearing
    from rom.components.journal_bearing.films.oil import Oil
    from rom.config.connections import Entry

FILMS_MODULE = "rom.components.journal_bearing.films"
VISCOSITY = Key("viscosity", Positive("Pa s"), "Dynamic.", ...)
GRADE = Key("grade", Whole(1), "ISO VG 32, 46 or 68.", ...)
OIL_OF_KEY = {"viscosity": "constant", "grade": "grade", "nu_40": "oil"}
OILS = {
    "constant": Table("A viscosity that stays.", (VISCOSITY,)),
    "grade": Table("A usual mineral oil.", (GRADE,)),
    "oil": Declared(
        f"{FILMS_MODULE}.oil:Oil",
        about="Any mineral oil.",
        nu_40=Positive("m^2/s"),
        nu_100=Positive("m^2/s"),
    ),
}
Values = dict[str, Any]  # of the keys of an entry
GROOVE = Declared(f"{FILMS_MODULE}.bearing:Groove", share=Positive())
JOURNAL_BEARING = Declared(
    f"{FILMS_MODULE}.bearing:JournalBearing",
    Key("grooves", Named(GROOVE, "grooves"), "Inlets of oil.", {}),
    Key("lobes", Whole(2), "Number of arcs of such a bore.", 2),
    Key("first_lobe", Quantity("rad"), "Middle of one of them.", 0.0),
    Key("cells_around", Whole(12), "Of the film.", 120),
    Key("cells_along", Whole(2), "Of its width, or of half of it.", 8),
    about="An oil film.",
    without="cells",
)


def journal_bearing(values: Values) -> "JournalBearing":
    """The sizes of an oil film."""
    from rom.components.journal_bearing.films.bearing import Groove, JournalBearing, multilobe

    sizes = dict(values)
    sizes["grooves"] = [Groove(**groove) for groove in sizes["grooves"].values()]
    sizes["cells"] = tuple(sizes.pop(f"cells_{axis}") for axis in ("around", "along"))
    lobes, preload, first = (sizes.pop(key) for key in ("lobes", "preload", "first_lobe"))
    sizes["bore"] = multilobe(lobes, preload, first=first) if preload else None
    return JournalBearing(**sizes)


def oil(values: Values) -> "Oil | float":
    """A viscosity [Pa s], or an oil."""
    from rom.components.journal_bearing.films.oil import Oil, iso_vg

    given = values | {key: 1e6 * values[key] for key in ("nu_40", "nu_100") if key in values}
    kind = given.pop("kind")
    if kind == "constant":
        return float(given["viscosity"])
    return iso_vg(**given) if kind == "grade" else Oil(**given)  # which takes [mm^2/s]


def add_film(entry: "Entry") -> None:
    """An oil film of an entry."""
    values = entry.values
    values |= {"bearing": journal_bearing(values["bearing"]), "oil": oil(values["oil"])}
    entry.made.journal_bearing(entry.name, *entry.ends, **values)


SECTION = Section(
    "journal bearings",
    Declared(
        "journal_bearing",
        Key("between", Markers(two=True), "On the axis of the journal, amid the bush.", ...),
        Key("bearing", JOURNAL_BEARING, "Its sizes.", ...),
        Key("oil", Variants(OILS, OIL_OF_KEY), "In it.", ...),
    ),
    add_film,
)
