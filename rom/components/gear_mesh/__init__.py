"""Gear meshes: involute pairs, compliance of their teeth, contact on the base plane.

`field` says what they have for mechanisms, their files (`keys`) and pictures (`symbols`);
`tooth_loads` are those of a motion. `compliance` has teeth in closed form and `tooth_elements` by
finite elements, `contact` the forces between them; pairs and elements are in `gears`.
"""

from rom.lazy import front

front(__name__)
