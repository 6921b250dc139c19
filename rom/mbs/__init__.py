"""Mechanisms of rigid and flexible bodies, and their motion.

`kernels` are compiled by `compiler`, `parts` and `elements` what a mechanism has, `connections` its
joints, `mechanism` what users write; `equations` packs it, `integrate` moves it, `results` are what
comes out, `analysis` needs no motion.
"""

from rom.lazy import front

front(__name__)
