"""Python, the light libraries, the BLAS in use, memory and cores."""

import os
import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter

import numpy as np

from rom.doctor.core import abilities, better, taken_for
from rom.doctor.finding import Finding
from rom.fe.probe import mapped_files
from rom.process.memory import free_bytes

BLAS_FILE = re.compile(r"/lib(blas|openblas|scipy_openblas|mkl_rt|blis|flexiblas|cblas)[^/]*\.so")
FAST = re.compile(r"openblas|mkl|blis|atlas", re.IGNORECASE)
SLOW_ADVICE = "5 to 9 times faster: sudo apt-get install libopenblas0-pthread"


def light() -> list[Finding]:
    """Python and the libraries everything needs; without them nothing of rom starts."""
    kind = "environment" if sys.prefix != sys.base_prefix else "system"
    found = [Finding("Python", "python", f"{platform.python_version()} ({kind}, {sys.prefix})")]
    for name in ("numpy", "scipy", "numba"):
        try:
            found.append(Finding("Python", name, version(name)))
        except PackageNotFoundError:
            found.append(Finding("Python", name, "", "broken", f"pip install {name}"))
    return found


def blas(mapped: list[str]) -> list[Finding]:
    """Which BLAS does the work, and how fast it is.

    Args:
        mapped: library files a process with PETSc has loaded; those of this one when empty.
    """
    speed = _gigaflops()
    files = sorted({f for f in mapped or mapped_files() if BLAS_FILE.search(f)})
    slow = [f for f in files if not FAST.search(f)]
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
    began = perf_counter()
    A @ A
    return 2e-9 * n**3 / (perf_counter() - began)


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
