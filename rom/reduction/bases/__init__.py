"""Bases of shapes, one method each.

`method` has Guyan and Craig-Bampton, enhanced too, and loads beside any of them; `fixed_interface`,
`free_interface`, `assumed`, `krylov` and `balanced` the others; `selection` says how many modes a
band needs.
"""
