"""Gear meshes of involute wheels.

`geometry` has the pairs and `racks` those of a pinion and a rack, `corrections` what is taken off
their flanks and what was measured on them, `hertz` their contact, `meshes` the element between two
bodies, and where the teeth of a train stand. `table` has its arrays; of its kernels `wheels` has
where these stand to each other, `slices` the pieces of contact lines and gaps, `coupling` what they
bear, `sliding` damping and friction, `rims` wheels that deform, and `teeth` puts them together.
"""
