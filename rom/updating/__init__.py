"""Updating of models by measured frequency responses: names of `rom.components.updating`.

See docs/theory/updating.md.
"""

from rom.lazy import front

front(__name__)
