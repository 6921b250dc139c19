"""Solids under heat and in steady rotation: names of `rom.components.wheels.prestress`.

See docs/theory/rotating_solids.md.
"""

from rom.lazy import front

front(__name__)
