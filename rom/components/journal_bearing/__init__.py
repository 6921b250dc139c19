"""Hydrodynamic journal bearings: the film, what carries the load, heat, and stability of whirl.

`field` says what they have for mechanisms, their pictures and files (`keys`); `record`
is that of a motion. `oil_film` gives pressure and forces, `statics` rest, stability and heat,
`closed_forms` short and long bearings. Bearings, oils and what is compiled are in `films`.
"""

from rom.lazy import front

front(__name__)
