"""Elements of force, one family in one file: as users describe them, their arrays and kernels.

`family` says what a family is, `pair_motion` has kernels that several share, and `cylinders` rims
that deform. There are `springs`, `rotational_springs`, `loads`, `motors`, `frictions`, `stops`,
`bushings`, `spread_loads`, `nonlinear` bodies, and `laws` of the user, with `law_calls` and
`laws_in_python`; `contact`, `rods`, `tendons`, `gears`, `rolling`, `films`, `round_bodies`,
`solids` and `formulas` have folders.
"""

from rom.lazy import front

front(__name__)
