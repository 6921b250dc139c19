"""Mechanisms of rigid and flexible bodies, and their motion.

`kernels` are compiled by `compiler`; a mechanism has `parts`, `connections` and `elements`, in
`mechanism` is what users write; `equations` packs it, `integrate` moves it, `results` are what
comes out, `analysis` needs no motion.
"""

from rom.lazy import front

front(__name__)
