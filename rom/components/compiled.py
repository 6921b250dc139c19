"""The compiler of components' kernels, which may make arrays; those of `rom.mbs` may not."""

from typing import Any

from numba import cfunc, njit

from rom.mbs.elements.nonlinear import LAW_SIGNATURE, Elements
from rom.mbs.kernels.compiled import OPTIONS, drop_stale_cache
from rom.model import Array, Index

__all__ = ["drop_stale_cache", "elements", "inner", "kernel", "law"]

_OPTIONS = OPTIONS | {"_nrt": True}
# callable from Python
kernel = njit(**_OPTIONS)
# callable from other kernels only
inner = njit(**_OPTIONS, no_cpython_wrapper=True, no_cfunc_wrapper=True)
# of the elements of non-linear bodies, see `rom.mbs.elements.nonlinear`
law = cfunc(LAW_SIGNATURE, **_OPTIONS)


def elements(compiled: Any, frames: Index, numbers: Array) -> Elements:
    """Elements with a compiled law."""
    return Elements(compiled.address, frames, numbers, compiled)
