"""Stones in contact.

`stones` puts walls and arches together and moves them, `limits` finds the loads they bear;
`discontinuous_deformation` and `block_contact` are the compiled kernels.
"""

from rom.lazy import front

__all__ = [
    "CONTACT_REACH_RATIO",
    "SHEAR_STIFFNESS_RATIO",
    "TENSION_RTOL",
    "Masonry",
    "Motion",
    "Stone",
    "polygon_moments",
    "reduced_stone",
    "simulate",
    "stone",
    "touching",
]
__getattr__ = front(__name__, "stones", __all__)
