"""Reduced-order flexible bodies: finite elements in, floating-frame multibody models out.

Importing ``rom`` needs NumPy, SciPy and Numba only. Everything that needs dolfinx, PETSc or gmsh
lives in ``rom.fe`` and is imported when it is first used.
"""

import importlib
from typing import Any

from rom.body.damping import ModalDamping, Rayleigh
from rom.body.flexible import FlexibleBody
from rom.checks import check
from rom.errors import RomError
from rom.io.export import export
from rom.io.native import load, save
from rom.model import (
    Attachment,
    Basis,
    FEModel,
    Interface,
    Material,
    Modes,
    Orthotropic,
    Report,
    SurfaceMesh,
)
from rom.reduction.fixed_interface import craig_bampton
from rom.reduction.method import CraigBampton
from rom.workflow import modes, reduce

__version__ = "0.1.0"

__all__ = [
    "Attachment",
    "Basis",
    "CraigBampton",
    "FEModel",
    "FlexibleBody",
    "Interface",
    "Material",
    "ModalDamping",
    "Modes",
    "Orthotropic",
    "Rayleigh",
    "Report",
    "RomError",
    "SurfaceMesh",
    "check",
    "craig_bampton",
    "export",
    "load",
    "modes",
    "reduce",
    "save",
]


def __getattr__(name: str) -> Any:
    """Import ``rom.fe``, ``rom.view`` and ``rom.mbs`` on first use."""
    if name in ("fe", "view", "mbs"):
        return importlib.import_module(f"rom.{name}")
    raise AttributeError(f"module 'rom' has no attribute {name!r}")
