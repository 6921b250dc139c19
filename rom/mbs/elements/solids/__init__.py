"""Solids at large deflection as bodies of mechanisms.

`field` lists them, `quartics` is what their strain energy has beyond that of small deflection, as
elements, `sampled` the same of material whose energy is no polynomial.
"""
