"""Hydrodynamic journal bearings: the film, what carries the load, heat, and stability of whirl.

`oil_film` gives pressure and forces, `statics` rest and stability, `oil` heat, `closed_forms` short
and long bearings. Bearings, oils and what is compiled are those of `rom.mbs.elements.films`.
"""

from rom.lazy import front

front(__name__)
