"""Round bodies: they turn in frames which do not, and their surfaces deform.

`field` says what they have for mechanisms. `spins` has their gyroscopic forces as elements,
`cylinders` their rims and bores, which gears and bearings press.
"""
