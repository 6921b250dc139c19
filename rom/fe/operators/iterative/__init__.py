"""Solving without a factor: what a whole block of vectors passes through together.

`multigrid` approximates an inverse, `gradients` solve with it, `search` finds modes with it and
says, by Lanczos' recurrence, how surely none of them is missing.
"""
