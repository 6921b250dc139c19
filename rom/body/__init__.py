"""Flexible bodies: inertia integrals, reference conditions, damping.

`projection`, `inertia` and `reference` make the constants of the floating frame; `stiffening`,
`prestress` and `rotating` the terms of loads and speed; `recovery` and `correction` give stress;
`spread` and `damping` act on a body, `conversion` changes its units. `flexible` holds all of it:
the body.
"""

from rom.lazy import front

front(__name__)
