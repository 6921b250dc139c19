"""What round bodies that spin have for mechanisms."""

from rom.fields import Field

FIELD = Field(
    families=("rom.components.round_bodies.spins:SPINS_FAMILY",),
    bodies={"spin": "rom.components.round_bodies.spins:spin_of"},
    moved={
        "rom.mbs.elements.round_bodies": "rom.components.round_bodies",
        "rom.mbs.elements.cylinders": "rom.components.round_bodies.cylinders",
    },
)
