"""Elements of force, as users describe them and as compiled laws.

`force_elements` has bushings, contacts by the laws of `impact`, and spread loads, compiled in
`bushing_kernels`, `contact` and `spread`; `joint_forces` motors, friction and stops, in
`joint_kernels`; `nonlinear` bodies, in `nonlinear_kernels`; `surface_contact` that of surfaces;
`springs_loads_kernels` springs and loads.
"""

from rom.lazy import front

front(__name__)
