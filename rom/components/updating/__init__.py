"""Updating by measured frequency responses: a test bed, `airframe`, and names of `rom.updating`.

After Berriet, Fillod and Bouhaddi. Unknown are relative changes of stiffness and mass and the
damping ratios of the modes. The model can be condensed to the sensors, and test and model together
to one common basis.
"""

from rom.lazy import front

front(__name__)
