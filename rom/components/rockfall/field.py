"""What rockfall galleries have for the doctor."""

from rom.fields import Field

FIELD = Field(first_use={"rockfall": "rom.components.rockfall.field:first_use"})


def first_use() -> None:
    """A boulder on a cushion of sand above a slab."""
    from rom.components.rockfall import Cushion, Gallery, Shear, Slab, strike

    sand, slab = Cushion.of_sand(4000.0, 1e6), Slab.of_mass(6000.0, 1.2e8)
    strike(Gallery(4000.0, 15.0, 2500.0, sand, shear=Shear(2e9), slab=slab), t_end=1e-3)
