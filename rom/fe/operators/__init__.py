"""The verbs of `rom.eigen` with PETSc and SLEPc, on any number of ranks.

`petsc` has them, `tied` for cyclic faces; `held` and `factor` or `iterative` solve, `lanczos`
and `krylov_schur` find modes, `counting` proves that none is missed.
"""
