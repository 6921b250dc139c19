"""The compiler of components' kernels, which may make arrays; those of `rom.mbs` may not."""

from typing import Any

from numba import njit
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

from rom.mbs.compiler.cache import guard, kept
from rom.mbs.elements.nonlinear import LAW_SIGNATURE, Elements
from rom.mbs.kernels.compiled import INNER_OPTIONS, OPTIONS
from rom.model import Array, Index

_OPTIONS = OPTIONS | {"_nrt": True}
# callable from Python
kernel = kept(njit(**_OPTIONS))
# callable from other kernels only
inner = njit(**INNER_OPTIONS | {"_nrt": True})


def law(function: Any) -> Any:
    """Compile a law of non-linear elements, see `rom.mbs.elements.nonlinear`."""
    options = {name: value for name, value in _OPTIONS.items() if name != "cache"}
    made = CFunc(function, normalize_signature(LAW_SIGNATURE), {}, options)
    made.enable_caching()
    guard(made, function)
    made.compile()
    return made


def elements(compiled: Any, frames: Index, numbers: Array) -> Elements:
    """Elements with a compiled law."""
    return Elements(compiled.address, frames, numbers, compiled)
