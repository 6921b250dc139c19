"""Solids at large deflection.

`quartic` is the strain energy of the coordinates, `sampled` that of neo-Hookean material by a few
elements, `statics` balances it with loads and `full` all finite elements, `ranges` says which loads
a body is to bear, `geometric` finds the shapes for them, and `cauchy` the stress.
"""
