"""Elements of force, one family in one file: as users describe them, their arrays and kernels.

`field` lists them, `family` says what a family is, `joint_forces` has the place and the laws of all
forces along joint coordinates. There are `springs`, `rotational_springs`, `loads`, `motors`,
`frictions`, `stops`, `bushings`, `spread_loads`, `nonlinear` bodies, and `laws` of the user, with
`law_calls` and `laws_in_python`; `contact`, `solids` and `formulas` have folders.
"""

from rom.lazy import front

front(__name__)
