"""A wind turbine, the NREL 5 MW reference.

`wind_turbine` has blade and tower as rods, `drivetrain` the run-up of the rotor, `blade_element`
the wind, `whole_turbine` all in one mechanism.
"""

from rom.lazy import front

front(__name__)
