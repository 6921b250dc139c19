"""Bodies that depend on parameters: names of `rom.components.families`.

See docs/theory/updating.md.
"""

from rom.lazy import front

front(__name__)
