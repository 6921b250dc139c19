"""Fingers of springs that cables close.

At rest: `compliant_hand` puts fingers together from springs and the `cable`, and closes them on a
bar; `solid_finger` has reduced solids as phalanges. In time: `moving_hand` is a mechanism, closed
by `winches` that follow the commands of the `control_chart` around `held_objects`; `budgets` weigh
it and judge its stresses.
"""

from rom.lazy import front

front(__name__)
