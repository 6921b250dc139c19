"""Stones in contact.

`stones` puts walls and arches together, `drawings` takes them from plane surfaces, `motion` moves
them, `limits` finds the loads they bear;
`actions` are loads, moving supports and earthquakes, `joints` laws of joints;
`discontinuous_deformation` and `block_contact` are the compiled kernels, which the doctor
compiles by `field`.
"""

from rom.lazy import front

front(__name__)
