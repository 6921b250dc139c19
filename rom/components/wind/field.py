"""What wind turbines have for the doctor."""

from rom.fields import Field

FIELD = Field(first_use={"wind": "rom.components.wind.field:first_use"})


def first_use() -> None:
    """A rotor in steady wind, its control, and a turbine of two blades."""
    from rom.components.wind.blading import blading, rotor_load
    from rom.components.wind.operation import operate
    from rom.components.wind.whole_turbine import turbine
    from rom.mbs.integrate.simulation import simulate

    rotor_load(blading(), 8.0, 1.0, n_azimuths=3)
    operate(lambda t: 8.0, 0.1)
    simulate(turbine(2, tower_segments=0, wind=8.0).mechanism, t_end=2e-4, dt=1e-4)
