"""Paths of solutions over a parameter.

`arc_length` follows any path past limit points, `load_steps` one of a load that grows.
"""
