"""Reduced-order flexible bodies: finite elements in, floating-frame multibody models out.

Importing ``rom`` needs NumPy, SciPy and Numba only. Everything that needs dolfinx, PETSc or gmsh
lives in ``rom.fe`` and is imported when it is first used.
"""

# Nothing is imported here that Python has not loaded itself: `python -m rom` comes by before
# `rom.__main__` can take the working folder off the path, and a typing.py may lie in it.
import importlib
import os

import rom.moved  # noqa: F401  old paths of modules
from rom.launcher import one_thread_each as _one_thread_each

# Empty is the default; it wins over a .numba_config.yaml in the working folder, by which Numba
# would load compiled code from wherever that file says.
for _name in ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES"):
    os.environ.setdefault(_name, "")
_one_thread_each()

__version__ = "0.1.0"

PACKAGES = (
    "body", "components", "cyclic", "eigen", "errors", "fe", "io", "mbs", "model", "reduction",
    "rotation", "units", "view",
)  # fmt: skip


def _public() -> dict[str, str]:
    """{name: module below rom} from the stub: asking for help must not load SciPy."""
    with open(f"{__path__[0]}/__init__.pyi", encoding="utf-8") as stub:
        text = stub.read().replace("(\n", "").replace(",\n)", "")  # lines that are too long
    lines = (line.split() for line in text.splitlines() if line.startswith("from rom."))
    return {name: module.removeprefix("rom.") for _, module, _, name, *_ in lines}


MODULES = _public()
__all__ = sorted(MODULES)


def __getattr__(name: str) -> object:
    """Import packages, and the modules of public names, on first use."""
    if name in PACKAGES:
        return importlib.import_module(f"rom.{name}")
    if name in MODULES:
        return getattr(importlib.import_module(f"rom.{MODULES[name]}"), name)
    raise AttributeError(f"module 'rom' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *PACKAGES})
