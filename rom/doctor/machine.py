"""The BLAS in use, memory and cores, and code kept on disk with what killed runs left there."""

import os
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rom.doctor.core import abilities, better, taken_for
from rom.doctor.probes import Finding
from rom.places import PACKAGE
from rom.process.memory import free_bytes, mapped_files

BLAS_FILE = re.compile(r"/lib(blas|openblas|scipy_openblas|mkl_rt|blis|flexiblas|cblas)[^/]*\.so")
FAST_BLAS = re.compile(r"openblas|mkl|blis|atlas", re.IGNORECASE)
SLOW_ADVICE = "5 to 9 times faster: sudo apt-get install libopenblas0-pthread"
REMOVE_COMMAND = "rom doctor --fix"
AT_WORK = 60.0  # seconds after which nobody is still writing a temporary file
END_OF_PICKLE = b"."


def blas(mapped: list[str]) -> list[Finding]:
    """Which BLAS of the files a process with PETSc has mapped, or this one, and how fast it is."""
    speed = _gigaflops()
    files = sorted({f for f in mapped or mapped_files() if BLAS_FILE.search(f)})
    slow = [f for f in files if not FAST_BLAS.search(f)]
    named = ", ".join(slow or files) or "not found in the memory map"
    found = [Finding("BLAS", "library", named)]
    if slow:
        found = [Finding("BLAS", "library", f"reference, {named}", "note", SLOW_ADVICE)]
    wanted = better(taken_for(), abilities())
    if wanted:
        advice = f"several times faster: export OPENBLAS_CORETYPE={wanted}"
        found.append(Finding("BLAS", "processor", f"taken for a {taken_for()}", "note", advice))
    return [*found, Finding("BLAS", "matrix product", f"{speed:.1f} GFlop/s")]


def _gigaflops(n: int = 400) -> float:
    A = np.ones((n, n))
    A @ A
    began = time.perf_counter()
    A @ A
    return 2e-9 * n**3 / (time.perf_counter() - began)


def machine() -> list[Finding]:
    """Memory and cores."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    free = free_bytes() / 2**30
    cores = len(os.sched_getaffinity(0))
    threads = os.environ.get("OMP_NUM_THREADS", "not set")
    return [
        Finding("machine", "memory", f"{total:.1f} GiB, of which {free:.1f} GiB may be taken"),
        Finding("machine", "cores", f"{cores}, OMP_NUM_THREADS {threads}"),
    ]


def caches(forms: dict[str, Any], *, fix: bool) -> list[Finding]:
    """State of the cache of compiled forms, by what the probe says, and of Numba's.

    To fix is to remove damaged files; the probe has removed those of forms.
    """
    found = [_form_cache(forms, fix)] if "path" in forms else []
    damaged = [path for folder in numba_folders() for path in damaged_files(folder)]
    if fix:
        for path in damaged:
            path.unlink(missing_ok=True)
    return [*found, _cache("compiled by Numba", "", damaged, fix)]


def _form_cache(forms: dict[str, Any], fix: bool) -> Finding:
    if not forms["writable"]:
        value = f"{forms['path']} cannot be written; forms are compiled in every run"
        return Finding("caches", "compiled forms", value, "note", f"chown it: {forms['path']}")
    return _cache("compiled forms", forms["path"], forms["stale"], fix)


def _cache(name: str, where: str, damaged: list[Any], fix: bool) -> Finding:
    if not damaged:
        return Finding("caches", name, f"{where} healthy".strip())
    if fix:
        return Finding("caches", name, f"{len(damaged)} damaged files removed {where}".strip())
    value = f"{len(damaged)} damaged files, e.g. {damaged[0]}"
    return Finding("caches", name, value, "note", REMOVE_COMMAND)


def numba_folders() -> Iterator[Path]:
    """Where Numba may keep what it compiled for rom."""
    own = os.environ.get("NUMBA_CACHE_DIR")
    if own:
        yield Path(own)
    yield PACKAGE


def damaged_files(folder: Path) -> Iterator[Path]:
    """Index and code files that end in the middle, and temporary ones nobody writes any more."""
    for path in sorted(folder.rglob("*.nb[ic]*")):
        try:
            if ".tmp." in path.name:
                damaged = time.time() - path.stat().st_mtime > AT_WORK
            else:
                damaged = path.read_bytes()[-1:] != END_OF_PICKLE
        except OSError:
            continue
        if damaged:
            yield path
