"""Bodies that depend on parameters.

`parameters` are factors of material and thickness, `layers` thick ones; `affine` and `stretched`
reduce, on a `common_basis`; `family` is the result, with `evidence`.
"""
