"""Linkages of two motors.

`two_dof_linkages` and `prismatic_linkages` are the mechanisms, of `chains` that may meet in a tip;
`dynamic_isotropy` says where both motors feel the same, `isotropic_sets` of what kind the set of
such postures is, and how equal a tool feels the mechanism. `field` is what the doctor compiles.
"""

from rom.lazy import front

front(__name__)
