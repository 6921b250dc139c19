"""What OpenBLAS takes the processor for, and what it could do.

An OpenBLAS older than the processor takes it for one of 2004 without AVX and multiplies matrices
five times slower than it could. OPENBLAS_CORETYPE, set before the library is loaded, corrects that.

``python -m rom.doctor.core`` prints the line of a .pth file that sets it, or nothing.
"""

import ctypes
import re
import sys
from pathlib import Path

# functions that tell, of Debian's OpenBLAS and of those in wheels
CORE_NAMES = [f"{p}openblas_get_corename{s}" for p in ("", "scipy_") for s in ("", "64_")]
MISTAKEN_CORES = {"Prescott", "Core2", "Generic", "generic"}
CORE_FLAGS = {
    "SkylakeX": {"avx512f", "avx512bw", "avx512dq", "avx512vl"},
    "Haswell": {"avx2", "fma"},
}


def taken_for(file: str = "libopenblas.so.0") -> str:
    """The processor an OpenBLAS works for; empty where the file is none."""
    try:
        library = ctypes.CDLL(file)
    except OSError:
        return ""
    for ask in filter(None, (getattr(library, name, None) for name in CORE_NAMES)):
        ask.restype = ctypes.c_char_p
        return str(ask().decode())
    return ""


def abilities(cpuinfo: Path = Path("/proc/cpuinfo")) -> set[str]:
    """Instruction sets of this processor; empty where the system does not tell."""
    try:
        flags = re.search(r"^flags\s*:(.*)$", cpuinfo.read_text(), re.MULTILINE)
    except OSError:
        return set()
    return set(flags[1].split()) if flags else set()


def better(core: str, flags: set[str]) -> str:
    """The core OpenBLAS should work for by these flags; empty when the one it takes is right."""
    able = [name for name, needed in CORE_FLAGS.items() if needed <= flags]
    return able[0] if core in MISTAKEN_CORES and able else ""


if __name__ == "__main__":
    wanted = better(taken_for(), abilities())
    if wanted:
        line = f'import os; os.environ.setdefault("OPENBLAS_CORETYPE", "{wanted}")\n'
        sys.stdout.write(line)
