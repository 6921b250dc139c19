"""What a motion leaves.

`state` is one instant, in memory and in a file, `solution` all of them, with `whereabouts` of its
bodies and `interpolation` between; what is `recomputed`, joints with it, and the `element_record`
of a force element or law follow from it; `audit` judges it.
"""
