"""Gear meshes of involute wheels.

`geometry` has the pairs, `corrections` what is taken off their flanks and what was measured on
them, `hertz` their contact, and `meshes` the element between two bodies. `table` has its arrays;
of its kernels `wheels` has where these stand to each other, `flanks` the gaps, `elasticity` what a
slice bears, `coupling` slices that carry each other, `sliding` damping and friction, `rims` wheels
that deform, and `teeth` puts them together.
"""
