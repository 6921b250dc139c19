"""Benchmarks: ratios measured in one run.

`models` are the components, `loops` and `wheel` two large measurements, `peers` the other programs;
`benchmarks` lists them all for ``rom bench``.
"""

from rom.lazy import front

__all__ = [
    "BED",
    "BENCHMARKS",
    "KINDS",
    "Figure",
    "blade",
    "chain",
    "film",
    "geometry",
    "integrator",
    "large_reduction",
    "motion",
    "reduction",
    "rods",
    "run",
    "transmission",
]
__getattr__ = front(__name__, "benchmarks", __all__)
