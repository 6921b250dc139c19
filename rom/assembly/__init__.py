"""Bodies put together before any motion.

`assembly` joins reduced bodies at interfaces, with `coupling` of what does not fit node by node,
and with their certificates; `condensed` keeps the modes of the whole; `dual` couples free
substructures by the forces between; `pieces` are of one body that bends far.
"""

from rom.lazy import front

front(__name__)
