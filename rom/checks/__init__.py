"""Quality gates, and what a reduction lost.

`gates` checks models and bodies row by row, `certificate` compares full with reduced, `deflection`
the same at large deflection; `draft` is a reduction under way, which both judge; `glued` is the
solid of which pieces were cut.
"""

from rom.lazy import front

front(__name__)
