"""What mechanisms are made of: bodies, joints and signals, and checks of arguments."""

from rom.lazy import front

__all__ = [
    "GROUND",
    "SINGULAR_MASS",
    "SURFACE_PREFIX",
    "Marker",
    "Part",
    "flexible_part",
    "ground_part",
    "mass_at_rest",
    "rigid_part",
    "surface_place",
]
__getattr__ = front(__name__, "bodies", __all__)
