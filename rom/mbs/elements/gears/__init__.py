"""Gear meshes of involute wheels.

`geometry` has the pairs, `corrections` what is taken off their flanks, `meshes` the element between
two bodies, and `teeth` its kernels.
"""
