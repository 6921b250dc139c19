"""Wheels whose blades differ.

`blade` reduces one, `substructured_sector` what is left, `disk` the rest without blades;
`bladed_wheel` puts any together, `mistuning` varies them a little.
"""

from rom.lazy import front

__all__ = [
    "ROOT_MATCH_RTOL",
    "SHARED_STIFFNESS_RTOL",
    "ReducedBlade",
    "blade_in",
    "cut",
    "reduced_blade",
    "root_of",
    "stresses_of",
    "turning",
]
__getattr__ = front(__name__, "blade", __all__)
