"""Solids at large deflection.

`quartic` is the strain energy of the coordinates, `statics` balances it with loads, `ranges` says
which loads a body is to bear and `geometric` finds the shapes for them, `cauchy` the stress.
"""
