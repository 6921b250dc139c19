"""Bodies put together before any motion.

`assembly` joins reduced bodies at interfaces, with `coupling` of what does not fit node by node;
`condensed` keeps the modes of the whole; `dual` couples free substructures by the forces between;
`pieces` are of one body that bends far; `certificate` shows what the first two lost.
"""

from rom.lazy import front

front(__name__)
