"""What linkages have for the doctor."""

from rom.fields import Field

FIELD = Field(first_use={"linkages": "rom.components.linkages.field:first_use"})


def first_use() -> None:
    """Postures of a linkage of five bars."""
    from rom.components.linkages.dynamic_isotropy import angle_grid, isotropy_index
    from rom.components.linkages.two_dof_linkages import FiveBar, rod

    five = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.8),) * 2, payload=0.5)
    isotropy_index(five.inertia(*angle_grid(4)))
