"""Paths of solutions over a parameter.

`arc_length` follows any path, past limit points; `equilibria` are those of a mechanism over the
time at which its drives and loads are taken.
"""
