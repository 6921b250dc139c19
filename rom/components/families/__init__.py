"""Bodies that depend on parameters.

`parameters` are factors of material and thickness, `layers` thick ones; `affine` models of them,
`reduce` the way in one call from these to a `family`, with its certificate. Families that touch are
`assembled`. `file` writes and reads them, `field` says so to the core.
"""
