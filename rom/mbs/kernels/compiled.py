"""The compiler of the kernels; `rom.mbs.compiler.cache` keeps what it makes."""

import numba

from rom.mbs.compiler.cache import kept
from rom.mbs.compiler.intermediate import INTERMEDIATE_OPTIONS

# reassociation lets sums be vectorised; NaN and infinity keep their meaning. No kernel makes an
# array, so none counts references to them: a step took four times as long when all did
OPTIONS = {
    "cache": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc"},
}

INNER_OPTIONS = OPTIONS | {"cache": False} | INTERMEDIATE_OPTIONS
# callable from Python
kernel = kept(numba.njit(**OPTIONS), entry=True)
# callable from other kernels only, which alone are kept
inner = numba.njit(**INNER_OPTIONS)
# for functions that return a part of an array, which compiled functions without counting cannot
spliced = kept(numba.njit(**OPTIONS, inline="always"))


@inner
def copy(x, out):
    """Write the array x into out, which has its shape; ``out[:] = x`` would make an array."""
    for i in range(x.size):
        out.flat[i] = x.flat[i]
