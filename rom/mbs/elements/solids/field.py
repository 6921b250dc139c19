"""What bodies of large deflection give a mechanism."""

from rom.fields import Field

FIELD = Field(
    families=(
        "rom.mbs.elements.solids.quartics:QUARTICS_FAMILY",
        "rom.mbs.elements.solids.sampled:SAMPLES_FAMILY",
    ),
    bodies={"deflection": "rom.mbs.elements.solids.sampled:deflection_of"},
)
