"""Equilibria of a mechanism over the time at which its drives and loads are taken.

`equilibria` follows them past limit points and onto branches, by `rom.paths`.
"""
