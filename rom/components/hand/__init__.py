"""Fingers of springs that cables close.

`compliant_hand` puts fingers together from springs and the `cable`, `grasp` holds a bar,
`control_chart` has the commands, `solid_finger` reduced solids as phalanges.
"""

from rom.lazy import front

front(__name__)
