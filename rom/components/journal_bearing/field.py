"""What journal bearings have for mechanisms, motions, files, pictures and the doctor."""

from math import pi

from rom.fields import Field

FIELD = Field(
    families=("rom.components.journal_bearing.films.journal_bearings:JOURNAL_BEARINGS_FAMILY",),
    methods={
        "journal_bearing": "rom.components.journal_bearing.films.journal_bearings:journal_bearing",
        "journal_bearings": "rom.components.journal_bearing.films.journal_bearings:OilFilm",
    },
    columns={"journal_bearing": "rom.components.journal_bearing.record:journal_bearing"},
    sections={"journal_bearings": "rom.components.journal_bearing.keys:SECTION"},
    symbols={"journal_bearings": "rom.components.journal_bearing.films.journal_bearings:circles"},
    first_use={"journal_bearing": "rom.components.journal_bearing.field:first_use"},
    moved={
        "rom.mbs.elements.films": "rom.components.journal_bearing.films",
        "rom.mbs.results.bearing_record": "rom.components.journal_bearing.record",
    },
)


def first_use() -> None:
    """Pressure of both laws of cavitation, and a table of a film."""
    from rom.components.journal_bearing import Groove, JournalBearing, film
    from rom.components.journal_bearing.films.tabulated import table_of

    for law in ("reynolds", "jfo"):
        groove = [Groove(pi, 0.35)]
        bearing = JournalBearing(0.1, 0.05, 1e-4, groove, cavitation=law, aligned=True)
        film(bearing, (5e-5, 1e-5), speed=300.0, viscosity=0.03)
    table_of("film", JournalBearing(0.1, 0.05, 1e-4, cells=(12, 2)))
