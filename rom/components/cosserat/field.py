"""What rods have for mechanism files."""

from rom.fields import Field

FIELD = Field(
    sections={"rods": "rom.components.cosserat.keys:SECTION"},
    moved={"rom.mbs.elements.rods": "rom.components.cosserat"},
)
