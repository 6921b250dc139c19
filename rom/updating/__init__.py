"""Updating of models by measured frequency responses.

`estimate` updates a family of bodies: what was `measured`, with errors as `frf_data` has them,
beside the `family_model`, summed line by line in `normal_equations`, or by `equations` at the
sensors. What the data say is in `verdict`, which parameters they support in `comparison`. A test
is planned by `placement`.
For a body in `operation` few sensors are enough: `tracking` follows motion, forces and stress,
`parameter_tracking` also what changes, both by the `filter_steps`. Small models with matrices of
their own, after Berriet, Fillod and Bouhaddi: `models`, `methods`.
"""

from rom.lazy import front

front(__name__)
