"""Ball and roller bearings.

`field` says what they have for mechanisms, their files (`keys`) and pictures (`symbols`). `races`
has their geometry and the stiffness of one contact, `bearings` the element between two bodies, and
`contacts` its kernels.
"""
