"""h5py, loaded when a file of arrays is written."""

import sys
from importlib import import_module
from typing import Any

from rom.errors import ResourceError


def h5py(otherwise: str) -> Any:
    """The module; otherwise is the ending of files that do without.

    Wheels of h5py and dolfinx bring an HDF5 each. From ``dolfinx.fem.petsc`` on, every library of
    the process sees that of dolfinx, and h5py refuses it; loaded before, h5py keeps its own.
    """
    try:
        return import_module("h5py")
    except ModuleNotFoundError as error:
        raise ResourceError(
            "h5py is not installed.",
            hint=f"rom doctor says what to type; {otherwise} needs nothing.",
        ) from error
    except (ImportError, ValueError) as error:
        if "dolfinx" in sys.modules:
            cause = ": dolfinx has loaded another HDF5 before"
            cure = "Import h5py first in your script, or rom.fe before dolfinx"
        else:
            cause, cure = "", "rom doctor says what does not fit"
        raise ResourceError(
            f"h5py cannot be loaded{cause} ({error}).", hint=f"{cure}; {otherwise} needs nothing."
        ) from error
