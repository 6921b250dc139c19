"""Flexible bodies: inertia integrals, reference conditions, damping.

`records` are what a body consists of; `projection`, `inertia` and `reference` make the constants
of the floating frame, `frame` changes it; `stiffening`, `prestress` and `rotating` are the terms of
loads and speed, `nonlinear` the energy of large deflection; `recovery` gives stress;
`surface`, `spread` and `damping` act on a body, `conversion` changes its units. `flexible` holds
all of it: the body.
"""

from rom.lazy import front

front(__name__)
