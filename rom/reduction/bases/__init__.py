"""Bases of shapes, one method each.

`method` has Guyan and Craig-Bampton; `fixed_interface`, `free_interface`, `assumed`, `enhanced`,
`krylov`, `balanced` and `loads` the others; `selection` says how many modes a band needs.
"""
