"""The verbs of `rom.eigen` with PETSc and SLEPc, on any number of ranks.

`petsc` has them on matrices of `aij`, also in new coordinates; a `solver` is chosen by what is
`foreseen` of `memory` and `disk`: `factor` solves, over ranks `substructures`; `spectrum` finds
modes with a shift, `factor` proves that none is missed; `iterative` does all of it without a
factor. `workers` are ranks that each have whole matrices.
"""
