"""Elements of force, one family in one file: as users describe them, their arrays and kernels.

`field` lists them, `family` says what a family is, `joint_forces` has the place and the laws of all
forces along joint coordinates, as `joint_laws` and `motors` are. There are `springs`, `loads`,
`bushings`, `nonlinear` bodies, and `laws` of the user, with
`law_calls`, `solids` that bend far; `contact` and `formulas` have folders.
"""

from rom.lazy import front

front(__name__)
