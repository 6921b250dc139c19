"""What a motion leaves.

`state` is one instant, in memory and in a file, `solution` all of them, with `interpolation`
between; what is `recomputed`, the `element_record` of a force element or law and the `joint_motion`
of a joint follow from it; `audit` and `validity` judge it.
"""
