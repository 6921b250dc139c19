"""The compiler of the kernels, and the guard of its cache.

Numba keeps compiled code beside the source and notices when that file changes, but not when
another file changes whose functions were built in. Therefore the cache as a whole is dropped when
any kernel source differs from the one it was made from.
"""

import hashlib
from pathlib import Path
from typing import Any

from numba import njit

from rom.places import PACKAGE

FOLDER = PACKAGE / "mbs"  # kernels lie in several folders below
STAMP = FOLDER / "__pycache__" / "kernels.sha256"

USER = b".compiled import"  # in sources of kernels
BUILT_IN = "kernels"  # folder of what kernels contain: constants, layouts and options


def drop_stale_cache(folder: Path = FOLDER, stamp: Path = STAMP) -> bool:
    """Remove compiled kernels that were made from other sources; True when some were."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for source in sorted(folder.rglob("*.py")):
        text = source.read_bytes()
        if source.parent.name == BUILT_IN or USER in text:
            digest.update(text)
    try:
        if stamp.exists() and stamp.read_text() == digest.hexdigest():
            return False
        for compiled in folder.rglob("*.nb[ic]"):
            compiled.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(digest.hexdigest())
    except OSError:  # read-only installation: Numba keeps its cache in the user's folder
        return False
    return True


def compiled_before(function: Any) -> bool:
    """Whether an earlier process left the compiled form of a kernel in the cache."""
    name = f"*.{function.py_func.__name__}-*.nbi"
    return any(Path(function.stats.cache_path).glob(name))


drop_stale_cache()

# reassociation lets sums be vectorised; NaN and infinity keep their meaning. No kernel makes an
# array, so none counts references to them: a step took four times as long when all did
OPTIONS = {
    "cache": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc"},
}
# callable from Python
kernel = njit(**OPTIONS)
# callable from other kernels only: the way in from Python costs most of the compile time
inner = njit(**OPTIONS, no_cpython_wrapper=True, no_cfunc_wrapper=True)
# for functions that return a part of an array, which compiled functions without counting cannot
spliced = njit(**OPTIONS, inline="always")


@inner
def copy(x, out):
    """Write the array x into out, which has its shape; ``out[:] = x`` would make an array."""
    for i in range(x.size):
        out.flat[i] = x.flat[i]
