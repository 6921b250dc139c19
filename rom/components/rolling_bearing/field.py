"""What rolling bearings have for mechanisms, their files and pictures."""

from rom.fields import Field

FIELD = Field(
    families=("rom.components.rolling_bearing.bearings:ROLLING_BEARINGS_FAMILY",),
    methods={
        "rolling_bearing": "rom.components.rolling_bearing.bearings:rolling_bearing",
        "rolling_bearings": "rom.components.rolling_bearing.bearings:RollingBearing",
    },
    sections={"rolling_bearings": "rom.components.rolling_bearing.keys:SECTION"},
    symbols={"rolling_bearings": "rom.components.rolling_bearing.bearings:circles"},
    moved={"rom.mbs.elements.rolling": "rom.components.rolling_bearing"},
)
