"""Wheels of equal sectors, and solids under heat and in steady rotation.

`sector` and `faces` describe one, `modes` and `reduced` solve it; `rotation` lets it turn, on
springs or held, `travelling` has its waves over the speed; `blades` lets blades differ. `prestress`
is stress of heat and speed. `field` tells the core how a sector is reduced.
"""
