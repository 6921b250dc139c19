"""Ball and roller bearings.

`field` says what they have for mechanisms, their pictures and files (`keys`). `races`
has their geometry and the stiffness of one contact, `bearings` the element between two bodies.
"""
