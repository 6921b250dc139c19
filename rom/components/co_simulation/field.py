"""What units of other programs have for mechanisms."""

from rom.fields import Field

FIELD = Field(methods={"fmu": "rom.components.co_simulation.units:fmu"})
