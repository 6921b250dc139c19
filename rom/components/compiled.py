"""The compiler of components' kernels, which may make arrays; those of `rom.mbs` may not."""

from numba import njit

from rom.mbs.compiled import OPTIONS, drop_stale_cache

__all__ = ["drop_stale_cache", "inner", "kernel"]

_OPTIONS = OPTIONS | {"_nrt": True}
# callable from Python
kernel = njit(**_OPTIONS)
# callable from other kernels only
inner = njit(**_OPTIONS, no_cpython_wrapper=True, no_cfunc_wrapper=True)
