"""What is integrated over cells.

`material` and `region` say of what, `stress` and `finite_strain` how it resists, `nodes` counts
the dofs at a node.
"""
