"""The equations of motion.

`packing` makes arrays of a mechanism along its `graph`; `equations` has residual and tangents, with
forces of `python_laws`; `elimination` and `linear_solve` solve with them, in the `ordering` found
before, and `renewal` with films that change. Large statics have the same blocks as sparse matrices
by `pattern`, solved by `sparse_solve`; `signature` counts signs of eigenvalues.
"""
