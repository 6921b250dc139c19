"""What is integrated over cells.

`material` and `region` say of what, `stress` and `finite_strain` how it resists, `large_strain`
has the energy of shapes, `nodes` finds interfaces and the outer surface.
"""
