"""The equations of motion.

`packing` makes arrays of a mechanism along its `graph`; `equations` has residual and tangents,
`elimination` and `linear_solve` solve with them, in the `ordering` found before.
"""
