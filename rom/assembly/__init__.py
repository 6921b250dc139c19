"""Bodies put together before any motion.

`assembly` joins reduced bodies at interfaces, with `coupling` of what does not fit node by node;
`condensed` keeps the modes of the whole; `dual` couples free substructures by the forces between;
`certificate` shows what either lost.
"""

from rom.lazy import front

front(__name__)
