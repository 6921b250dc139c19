"""Mechanisms of rigid and flexible bodies, and their motion.

`mechanism` is what users write, of `parts`, `connections` and `elements`; `equations` packs it,
`integrate` moves it by `kernels`, `results` are what comes out, `analysis` needs no motion.
"""

from rom.lazy import front

front(__name__)
