"""What wheels have for reductions, and where their modules were."""

from rom.fields import Field

FIELD = Field(
    takes={"reduce.CyclicSector": "rom.components.wheels.reduced:reduced_by"},
    moved={
        "rom.cyclic": "rom.components.wheels",
        "rom.prestress": "rom.components.wheels.prestress",
    },
)
