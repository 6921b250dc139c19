"""The cache of compiled forms: its lock, its stale files, and option files, which are not read."""

import fcntl
import logging
import os
import shutil
import sys
import sysconfig
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mpi4py import MPI

import dolfinx.jit

from rom.errors import ResourceError, RomError, warn
from rom.fe.parallel import on_root
from rom.process.child import lasting_scratch, trusted

JIT_OPTIONS = {"cffi_extra_compile_args": ["-O2", "-g0"], "cffi_libraries": None, "timeout": 60}
# what dolfinx and FFCx call the function that reads option files, from version to version
READERS = ("_load_parameters", "_load_options")
OPTIONS_OF_FFCX = ("ffcx.parameters", "ffcx.options")
STALE_AFTER = 30.0  # seconds after which nobody can still be compiling one of our forms


@contextmanager
def compiling(comm: MPI.Comm) -> Iterator[None]:
    """Around everything that may compile a form: one job at a time, no stale file in the way.

    A compilation that was killed leaves a source file without a library; every later run waits
    for the library and gives up. Such files are removed here. Option files are not read: from one
    in the working folder dolfinx would take compiler flags, which can run any code.
    """
    _ignore_option_files()
    lock = on_root_lock(comm)
    on_root(comm, clear_stale_cache)
    previous = logging.root.manager.disable
    logging.disable(max(previous, logging.INFO))  # the compiler's command lines
    try:
        yield
    except Exception as error:
        lacking = not_here()
        if isinstance(error, RomError) or not lacking:
            raise
        raise ResourceError(
            f"forms are compiled by a C compiler for this Python, and {lacking} is not here.",
            hint="On Debian: apt-get install gcc libc6-dev python3-dev.",
        ) from error
    finally:
        logging.disable(previous)
        if lock is not None:
            os.close(lock)


def compiler() -> str:
    """The C compiler that Python calls for extensions."""
    named = os.environ.get("CC") or sysconfig.get_config_var("CC") or "gcc"
    return str(named).split()[0]


def not_here() -> str:
    """What forms cannot be compiled without and is missing; empty where all is there."""
    header = Path(sysconfig.get_path("include"), "Python.h")
    if not shutil.which(compiler()):
        return compiler()
    return "" if header.exists() else str(header)


def on_root_lock(comm: MPI.Comm) -> int | None:
    """Descriptor of the locked cache on rank 0, None elsewhere and where locks do not work."""
    path = on_root(comm, usable_cache)
    defaults = _defaults()  # coordinate maps are compiled inside dolfinx, which takes no options
    defaults["cache_dir"] = (path, *defaults["cache_dir"][1:])
    if comm.rank > 0:
        return None
    try:
        lock = os.open(path / "rom.lock", os.O_CREAT | os.O_RDWR)
        fcntl.flock(lock, fcntl.LOCK_EX)
    except OSError:  # some network file systems have no locks; the age of files must do
        return None
    return lock


def cache_directory() -> Path:
    """Where dolfinx keeps compiled forms."""
    return Path(str(_defaults()["cache_dir"][0])).expanduser()


def usable_cache() -> Path:
    """The cache of dolfinx, or a temporary one when that cannot be written, or others can."""
    path, why = cache_directory(), "cannot be written"
    try:
        path.mkdir(parents=True, exist_ok=True)
        if os.access(path, os.W_OK):
            if trusted(path):
                return path
            why = "belongs to somebody else, or others may write there"
    except OSError:
        pass
    warn(f"{path} {why}; forms are compiled anew for this run.")
    return lasting_scratch("jit")


def clear_stale_cache(directory: Path | None = None, age: float = STALE_AFTER) -> list[Path]:
    """Remove what a killed compilation left behind in the cache, or that of dolfinx; the sources.

    They must be so many seconds old; younger ones are waited for, somebody may be at work.
    """
    removed = []
    for source in sorted((directory or cache_directory()).glob("libffcx_*.c")):
        while _unfinished(source) and time.time() - source.stat().st_mtime < age:
            time.sleep(0.2)
        if _unfinished(source):
            source.unlink(missing_ok=True)
            removed.append(source)
    return removed


def stale_sources(directory: Path | None = None, age: float = STALE_AFTER) -> list[Path]:
    """What a killed compilation left behind, without touching it; arguments as above."""
    sources = sorted((directory or cache_directory()).glob("libffcx_*.c"))
    return [s for s in sources if _unfinished(s) and time.time() - s.stat().st_mtime >= age]


def _unfinished(source: Path) -> bool:
    return source.exists() and not source.with_suffix(".c.cached").exists()


def _defaults() -> dict[str, Any]:
    """The options of dolfinx, called parameters in the oldest version."""
    options = getattr(dolfinx.jit, "DOLFINX_DEFAULT_JIT_OPTIONS", None)
    return options or dolfinx.jit.DOLFINX_DEFAULT_JIT_PARAMETERS


def _ignore_option_files() -> None:
    for module in (dolfinx.jit, *filter(None, map(sys.modules.get, OPTIONS_OF_FFCX))):
        for name in READERS:
            if hasattr(module, name):
                setattr(module, name, lambda: ({}, {}))
