"""Elements of force.

Springs, bushings and contacts as users describe them, and beside them their compiled laws in
`..._kernels`.
"""

from rom.lazy import front

__all__ = ["DIRECTIONS", "Bushing", "Contact", "Curves", "Elements", "Spread"]
__getattr__ = front(__name__, "force_elements", __all__)
