"""Reduced-order flexible bodies: finite elements in, floating-frame multibody models out.

Importing ``rom`` needs NumPy, SciPy and Numba only. Everything that needs dolfinx, PETSc or gmsh
lives in ``rom.fe`` and is imported when it is first used.
"""

# Nothing is imported here that Python has not loaded itself: `python -m rom` comes by before
# `rom.__main__` can take the working folder off the path, and a typing.py may lie in it.
import os

from rom.lazy import front as _front
from rom.process.launcher import share_the_machine as _share_the_machine

# Empty is the default; it wins over a .numba_config.yaml in the working folder, by which Numba
# would load compiled code from wherever that file says.
for _name in ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES"):
    os.environ.setdefault(_name, "")
_share_the_machine()

__version__ = "0.1.0"

_front(__name__)
