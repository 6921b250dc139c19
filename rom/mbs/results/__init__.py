"""What a motion leaves.

`state` is one instant, `solution` all of them, with `interpolation` between; `recomputed` and
`interface_loads`, the `element_record` of a force element, the `law_record` of a law and the
`joint_motion` of a joint follow from it; `audit` and `validity` judge it, `checkpoint` saves it.
"""
