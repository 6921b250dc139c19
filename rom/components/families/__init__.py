"""Bodies that depend on parameters.

`parameters` are factors of material and thickness, `layers` thick ones; `affine` and `stretched`
models of them are reduced on a `common_basis`; `family` is the result, with `evidence`, and
`reduce` the way to it in one call. Families that touch are `assembled`. `file` writes and reads
them, `field` says so to the core.
"""
