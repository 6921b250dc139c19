"""What wheels have for reductions, and where their modules were."""

from rom.fields import Field

FIELD = Field(
    takes={"reduce.CyclicSector": "rom.components.wheels.reduced:reduced_by"},
    moved={
        "rom.cyclic.blades.records": "rom.components.wheels.blades.substructured_sector",
        "rom.cyclic.campbell": "rom.components.wheels.travelling",
        "rom.cyclic": "rom.components.wheels",
        "rom.prestress.heat": "rom.components.wheels.prestress.thermal",
        "rom.prestress.speed_table": "rom.components.wheels.prestress.spin_up",
        "rom.prestress": "rom.components.wheels.prestress",
    },
)
