"""What tendons have for mechanisms, their files and pictures."""

from rom.fields import Field

FIELD = Field(
    families=("rom.components.tendons.tendons:TENDONS_FAMILY",),
    methods={
        "tendon": "rom.components.tendons.tendons:tendon",
        "tendons": "rom.components.tendons.tendons:Tendon",
    },
    sections={"tendons": "rom.components.tendons.keys:SECTION"},
    symbols={"tendons": "rom.components.tendons.symbols:draw"},
    moved={"rom.mbs.elements.tendons": "rom.components.tendons"},
)
