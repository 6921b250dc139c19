"""Paths of solutions over a parameter.

`arc_length` follows any path, past limit points, for whoever brings the equations.
"""
