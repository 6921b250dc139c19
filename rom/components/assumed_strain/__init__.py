"""Assumed-strain triangle for plane and axisymmetric solids, after Flores.

Total Lagrangian. The metric is evaluated at the middles of the sides, each from the four nodes of
two neighbouring triangles; logarithmic strain, plasticity of von Mises with linear hardening.
`triangles` has the meshes, `actions` loads, drives and tools, `motion` forces and explicit steps,
the linear stiffness side by side, `implicit` equilibria and implicit steps, `space` sheets as
bodies, which bend; `kernels` are compiled, ahead by `field`.
See docs/theory/sheets.md.
"""

from rom.lazy import front

front(__name__)
