"""Tendons: cables through eyelets and over pulleys of any bodies.

`field` says what they have for mechanisms, their files (`keys`) and pictures (`symbols`).
`tendons` has the elements and their kernels, `routing` the lengths of straight pieces and how they
change, `tension` how friction and stretch share the force between the pieces, `paths` the whole
path at one instant.
"""
