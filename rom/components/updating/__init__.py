"""Updating of a model by measured frequency responses, after Berriet, Fillod and Bouhaddi.

Unknown are relative changes of stiffness and mass and the damping ratios of the modes. The model
can be condensed to the sensors, and test and model together to one common basis: `models` and
`methods`. `frf_data` are responses as a test gives them, `airframe` a test bed.
"""

from rom.lazy import front

front(__name__)
