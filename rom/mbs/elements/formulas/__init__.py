"""Formulas as programs that one compiled function runs, with exact derivatives.

A formula is a list of numbers, instructions and tables of piecewise polynomials: nothing is
compiled anew for another one. `codes` has the instructions, `taylor` runs them on values with first
and second derivatives, `programs` makes functions of time and of a coordinate of them, `lines` laws
of force along the line between two markers.
"""
