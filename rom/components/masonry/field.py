"""What masonry has for the doctor."""

from rom.fields import Field

FIELD = Field(first_use={"masonry": "rom.components.masonry.field:first_use"})


def first_use() -> None:
    """An arch at rest, and on ground that shakes."""
    from rom.components.histories import sine
    from rom.components.masonry.actions import BaseMotion
    from rom.components.masonry.limits import arch
    from rom.components.masonry.motion import simulate

    for actions in ((), (BaseMotion(sine(1.0, 0.5)),)):
        simulate(arch(3, 5.0, 0.6), t_end=2e-3, dt=1e-3, actions=actions, damping=30.0)
