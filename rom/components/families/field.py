"""What families of bodies have for files, and where their modules were."""

from rom.fields import Field

FIELD = Field(
    takes={
        "save.BodyFamily": "rom.components.families.file",
        "load.rom-family": "rom.components.families.file",
    },
    moved={"rom.parametric": "rom.components.families"},
)
