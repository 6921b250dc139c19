"""What studies have for the command line."""

from rom.fields import Field

FIELD = Field(verbs={"study": "rom.components.studies.verb"})
