"""The compiler of components' kernels, which may make arrays; those of `rom.mbs` may not."""

from numba import njit

from rom.mbs.compiler.cache import kept
from rom.mbs.kernels.compiled import INNER_OPTIONS, OPTIONS

_OPTIONS = OPTIONS | {"_nrt": True}
# callable from Python
kernel = kept(njit(**_OPTIONS))
# callable from other kernels only
inner = njit(**INNER_OPTIONS | {"_nrt": True})
