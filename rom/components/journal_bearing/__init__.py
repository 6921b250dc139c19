"""Hydrodynamic journal bearings: the film, what carries the load, heat, and stability of whirl.

`bearing` describes one, `oil_film` gives pressure and forces, `statics` rest and stability, `oil`
viscosity and heat, `closed_forms` short and long bearings; `film_kernel` and `band` are compiled.
"""

from rom.lazy import front

front(__name__)
