"""What journal bearings have for mechanisms, their motions, files and pictures."""

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
    moved={
        "rom.mbs.elements.films": "rom.components.journal_bearing.films",
        "rom.mbs.results.bearing_record": "rom.components.journal_bearing.record",
    },
)
