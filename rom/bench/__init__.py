"""Benchmarks: ratios measured in one run.

`models` are the components, `units` a gear unit for two programs, `two_stages` one of solids,
`loops`, `wheel`, `many_modes` and `updating` large measurements, `first_use` what compiles when it
is used first, `peers` the other programs; `benchmarks` lists them all for ``rom bench``.
"""

from rom.lazy import front

front(__name__)
