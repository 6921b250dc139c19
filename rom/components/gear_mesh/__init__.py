"""Gear meshes: involute pairs, compliance of their teeth, contact on the base plane.

`compliance` has teeth in closed form and `tooth_elements` by finite elements, `contact` the forces
between them; the pairs are those of `rom.mbs.elements.gears`.
"""

from rom.lazy import front

front(__name__)
