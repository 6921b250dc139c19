"""Engineering components on the light layers.

Structures: rods of `cosserat`, sheets of `assumed_strain`, `masonry`, `rockfall`.
Machines: `hand`, `linkages`, `wind`, `gear_mesh`, `journal_bearing`,
`rolling_bearing`, `transmission`, `wheels`, `tendons`, `round_bodies`. Methods: `families` of
bodies, their `updating` by measured responses, `orbits` that repeat, `best_matching`. `histories`
are what changes in time, `compiled` is the compiler of their kernels.
"""

from rom.lazy import front

front(__name__)
