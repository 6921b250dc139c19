"""Round bodies that turn in frames which do not.

`spins` has their gyroscopic forces as elements, `gyroscopic` their matrices.
"""
