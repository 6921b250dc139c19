"""A wind turbine, the NREL 5 MW reference.

`wind_turbine` has blade and tower as rods and the run-up of the rotor, `whole_turbine` all in one
mechanism, with its control. Of the wind, `profiles` has lift and drag, `momentum` the induction,
`blading` the dam of the tower and the loads of a rotor, `blade_element` those on rods, `wake` the
memory of their wake, `control` torque, pitch and power curve, `operation` the turbine in wind that
changes. `field` is what the doctor compiles.
"""

from rom.lazy import front

front(__name__)
