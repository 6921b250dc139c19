"""Where modules of orbits were."""

from rom.fields import Field

FIELD = Field(
    moved={
        "rom.mbs.analysis.periodic": "rom.components.orbits",
        "rom.mbs.analysis.continuation": "rom.components.orbits",
    }
)
