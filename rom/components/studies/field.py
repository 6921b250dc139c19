"""What studies have for files and the command line."""

from rom.fields import Field

FIELD = Field(
    sections={"study": "rom.components.studies.keys:STUDY"},
    verbs={"study": "rom.components.studies.verb"},
)
