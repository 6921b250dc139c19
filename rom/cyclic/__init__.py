"""Wheels of equal sectors: names of `rom.components.wheels`.

See docs/theory/cyclic_symmetry.md.
"""

from rom.lazy import front

front(__name__)
