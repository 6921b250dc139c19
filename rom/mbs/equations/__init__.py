"""The equations of motion.

`packing` makes arrays of a mechanism along its `graph`, in whose order `linear_solve` solves with
residual and tangents of `equations`, and `renewal` with films that change. Large statics have the
same blocks as sparse matrices, in `sparse_solve`.
"""
