"""The compiler of the kernels, and the guard of its cache.

Numba keeps compiled code beside the source and notices when that file changes, but not when
another file changes whose functions or layouts were built in. Therefore what it keeps says from
which sources it was made; code of others is never loaded, wherever Numba keeps it.
"""

import functools
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import IndexDataCacheFile

from rom.places import PACKAGE

IMPORTS = re.compile(rb"^from (rom[.\w]*) import (\([^)]*\)|.*)", re.MULTILINE)
# in sources of kernels, and the folder of what they contain: constants and layouts
KERNEL_MARK, LAYOUT_FOLDER = b"compiled import", "kernels"

# reassociation lets sums be vectorised; NaN and infinity keep their meaning. No kernel makes an
# array, so none counts references to them: a step took four times as long when all did
OPTIONS = {
    "cache": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc"},
}


def kept(compiler: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A decorator of Numba whose cache knows the sources that a function is made of."""

    def compiled(function: Any) -> Any:
        dispatcher = compiler(function)
        if not numba.config.DISABLE_JIT:
            guard(dispatcher._cache, Path(function.__code__.co_filename))
        return dispatcher

    return compiled


def guard(cache: Any, source: Path) -> None:
    """Let a cache of Numba load only what the present sources and version of Numba have made."""
    made_of = f"Numba {numba.__version__}, {digest(source)}"
    name = f"{cache._impl.filename_base}.numba-{numba.__version__}"
    cache._cache_file = IndexDataCacheFile(cache._cache_path, name, made_of)
    cache._cache_file._version = made_of  # compared before anything else is read


def compiled_before(function: Any) -> bool:
    """Whether an earlier process left the compiled form of a kernel in the cache."""
    return bool(function._cache._cache_file._load_index())


@functools.cache
def digest(source: Path) -> str:
    """Of a source and all that its kernels are made of."""
    found: set[Path] = set()
    _collect(source, found)
    return hashlib.sha256(b"".join(_read(path)[0] for path in sorted(found))).hexdigest()


def _collect(source: Path, found: set[Path]) -> None:
    found.add(source)
    for path in _read(source)[1]:
        if path not in found:
            _collect(path, found)


@functools.cache
def _read(source: Path) -> tuple[bytes, tuple[Path, ...]]:
    """The text of a source, and the files with kernels or layouts that it imports."""
    text = source.read_bytes()
    paths = set()
    for module, names in IMPORTS.findall(text):
        place = PACKAGE.joinpath(*module.decode().split(".")[1:])
        paths |= {place / f"{name.decode()}.py" for name in re.findall(rb"\w+", names)}
        paths.add(place.with_suffix(".py"))
    return text, tuple(sorted(path for path in paths if path.is_file() and _has_kernels(path)))


@functools.cache
def _has_kernels(path: Path) -> bool:
    return path.parent.name == LAYOUT_FOLDER or KERNEL_MARK in path.read_bytes()


# callable from Python
kernel = kept(numba.njit(**OPTIONS))
# callable from other kernels only: the way in from Python costs most of the compile time
inner = kept(numba.njit(**OPTIONS, no_cpython_wrapper=True, no_cfunc_wrapper=True))
# for functions that return a part of an array, which compiled functions without counting cannot
spliced = kept(numba.njit(**OPTIONS, inline="always"))


@inner
def copy(x, out):
    """Write the array x into out, which has its shape; ``out[:] = x`` would make an array."""
    for i in range(x.size):
        out.flat[i] = x.flat[i]
