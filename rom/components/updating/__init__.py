"""Updating of models by measured frequency responses.

`estimate` updates a family of bodies: what was `measured`, of files of `responses`, with errors as
`frf_data` has them, beside the `family_model`, by `normal_equations` of responses or of equations
at the sensors. What the data say is in `verdict`, which parameters they support in
`comparison`; a test is planned by `placement`. `verb` is that of the command line with its
`pictures`, `field` the record. `observers` follow a body in operation.
Small models with matrices of their own, after Berriet, Fillod and Bouhaddi: `models`, `methods` and
a test bed, `airframe`. Unknown are relative changes of stiffness and mass and the damping ratios of
the modes. The model can be condensed to the sensors, and test and model together to one basis.
"""

from rom.lazy import front

front(__name__)
