"""Reduction bases on operators and on plain matrices; no dolfinx, no PETSc."""
