"""Rotors: what turns steadily, and how small motions of what turns are counted.

`moving_axes` counts them body by body, `blades` those of identical blades together; `spins` says
which bodies turn about which axes.
"""
