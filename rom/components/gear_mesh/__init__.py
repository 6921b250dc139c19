"""Gear meshes: involute pairs, compliance of their teeth, contact on the base plane.

`geometry` has the pairs, `compliance` teeth in closed form and `tooth_elements` by finite elements,
`contact` the forces between them.
"""

from rom.lazy import front

front(__name__)
