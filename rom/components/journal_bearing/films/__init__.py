"""Oil films between journals and bushes as elements: Reynolds' equation in the frame of the bush.

`bearing` and `oil` describe them, `cells` has their arrays, `pressure` solves for the
pressure, `slopes` derives what it does, `tabulated` solves ahead for all places, `kinematics` says
how the journal moves in its bush and `bores` how that bends; `journal_bearings` is the element,
`journals` its kernels.
"""
