"""What is integrated over cells.

`material` and `region` say of what, `stress` and `large_strain` how it resists, `nodes` finds
interfaces and the outer surface.
"""
