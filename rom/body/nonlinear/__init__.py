"""Solids at large deflection.

`quartic` is the strain energy of the coordinates, `statics` balances it with loads, `geometric`
says which deflections a body is to reach and finds the shapes for them, `cauchy` the stress.
"""
