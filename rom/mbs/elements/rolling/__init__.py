"""Ball and roller bearings.

`races` has their geometry and the stiffness of one contact, `bearings` the element between two
bodies, and `contacts` its kernels.
"""
