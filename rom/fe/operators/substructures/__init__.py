"""One factor for several ranks: each has a substructure of its own, all have the border between.

`shared` divides the rows and solves; `mumps` calls MUMPS for a substructure, in an order of
elimination that ends in the border, which `rerooted.c` finds.
"""
