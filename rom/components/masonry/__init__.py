"""Stones in contact.

`stones` puts walls and arches together and moves them, `limits` finds the loads they bear;
`discontinuous_deformation` and `block_contact` are the compiled kernels.
"""

from rom.lazy import front

front(__name__)
