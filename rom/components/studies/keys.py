"""The table of a mechanism file that says which of its keys vary."""

from rom.arguments import Whole
from rom.components.studies.samples import KINDS, range_of
from rom.config.keys import Key, Named, Place, Table, Text, words, written
from rom.config.mechanism_keys import Section

RANGE = 'range of a key, as "0.1:0.5" or "0.001:0.05:log"'


@written(RANGE)
def ranges(value: object, place: Place) -> tuple[float, float, bool]:
    """Lowest and highest value, and whether logarithms are sampled evenly."""
    with place.told():
        return range_of(Text().read(value, place))


ABOUT = "Samples of some keys, of which `rom study` moves each."
STUDY = Section(
    "a study",
    Table(ABOUT, (
        Key("vary", Named(ranges, "keys"),
            'Ranges by key, as `"bodies.slider.mass" = "0.2:0.4"`; behind the name of a body also '
            "those of its component file, and mesh.NAME for a parameter of its geometry.", {}),
        Key("keep", words, 'What is kept of each motion, as "max(abs(crank pin force))".', ()),
        Key("samples", Whole(1), "How many; of a grid, for each key.", 16),
        Key("design", Text(KINDS), "How they fill the ranges.", KINDS[0]),
        Key("seed", Whole(), "Of the generator.", 1),
    )),
    summary=ABOUT,
    single=True,
)  # fmt: skip
