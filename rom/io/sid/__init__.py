"""Standard Input Data of flexible bodies.

`format` is the record and its text, `dialect` what programs do differently, `reading` parses,
`body` goes between a record and a flexible body.
"""

from rom.lazy import front

__all__ = [
    "ALWAYS_SYMMETRIC",
    "BLOCKS",
    "DIAGONAL",
    "DIALECTS",
    "GENERAL",
    "NODE_BLOCKS",
    "SYMMETRIC",
    "TENSOR",
    "UNIT",
    "ZERO",
    "StandardInput",
    "Taylor",
    "in_dialect",
    "repacked",
    "shape_of",
    "write_sid",
]
__getattr__ = front(__name__, "format", __all__)
