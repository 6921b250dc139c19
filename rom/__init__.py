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

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from rom.assembly.assembly import Assembly
    from rom.assembly.dual import DualAssembly, FreeSubstructure
    from rom.body.damping import ModalDamping, Rayleigh
    from rom.body.flexible import FlexibleBody
    from rom.body.spread import SpreadLoad, mass_load, surface_load
    from rom.checks.gates import check
    from rom.config.component import read_component
    from rom.config.mechanism import read_mechanism
    from rom.cyclic.blades.blade import reduced_blade
    from rom.cyclic.blades.bladed_wheel import BladedWheel
    from rom.cyclic.blades.disk import bladed_wheel
    from rom.cyclic.blades.mistuning import MistunedWheel, mistuned_wheel
    from rom.cyclic.blades.records import ReducedBlade
    from rom.cyclic.blades.substructured_sector import substructured_sector
    from rom.cyclic.campbell import WheelCampbell, wheel_campbell
    from rom.cyclic.modes import CyclicModes, cyclic_modes
    from rom.cyclic.reduced import reduce_sector
    from rom.cyclic.rotation import rotating_sector
    from rom.cyclic.sector import CyclicSector
    from rom.cyclic.supports import supported_sector
    from rom.cyclic.travelling import TravellingModes, travelling_modes
    from rom.errors import (
        ConfigError,
        FileFormatError,
        InterfaceError,
        InterruptedRun,
        MaterialError,
        MeshError,
        ModelError,
        ModesMissedError,
        ParallelError,
        ParameterError,
        QualityGateError,
        ResourceError,
        RomError,
        RomWarning,
        SolverError,
        TagError,
        UnsafeFileError,
    )
    from rom.fmu.export import write_fmu
    from rom.io.export import export
    from rom.io.family import load, save
    from rom.io.fields.vtu import write_stress, write_stress_history
    from rom.io.fmu.body import write_body_fmu
    from rom.io.history import write_history
    from rom.io.matrices.read_model import read_model
    from rom.io.sid.dialect import read_sid
    from rom.mbs.analysis.campbell import campbell
    from rom.mbs.analysis.equilibrium import equilibrium
    from rom.mbs.analysis.inverse_dynamics import inverse_dynamics
    from rom.mbs.analysis.linearize import linearize
    from rom.mbs.analysis.response import frequency_response, transmissibility
    from rom.mbs.analysis.sensitivity import (
        equilibrium_sensitivity,
        frequency_sensitivity,
        motion_sensitivity,
    )
    from rom.mbs.analysis.steady_motion import SteadyMotion, steady_motion
    from rom.mbs.integrate.keeping import Keeping
    from rom.mbs.integrate.release import release
    from rom.mbs.integrate.simulation import simulate
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.results.audit import audit
    from rom.mbs.results.checkpoint import load_state, save_state
    from rom.model import (
        Attachment,
        Basis,
        FEModel,
        Interface,
        Layered,
        Material,
        Modes,
        Orthotropic,
        Region,
        Report,
        SurfaceMesh,
    )
    from rom.parametric.family import BodyFamily
    from rom.parametric.parameters import Density, Thickness, YoungsModulus
    from rom.parametric.reduce import reduce_parametric
    from rom.prestress.heat import Heat
    from rom.prestress.speed_table import ReducedSpinUp, SpinUp
    from rom.prestress.spin_up import held_solid, spin_up
    from rom.prestress.thermal import heated, heated_sector, thermal_buckling
    from rom.reduction.bases.balanced import BalancedTruncation, second_order_balanced_truncation
    from rom.reduction.bases.enhanced import EnhancedCraigBampton
    from rom.reduction.bases.fixed_interface import craig_bampton
    from rom.reduction.bases.free_interface import FreeFree, Herting, Rubin
    from rom.reduction.bases.krylov import MomentMatching
    from rom.reduction.bases.loads import WithLoads
    from rom.reduction.bases.method import CraigBampton, Guyan
    from rom.reduction.interfaces.characteristic import Characteristic
    from rom.reduction.interfaces.polynomial import FourierLegendre, Polynomial
    from rom.reduction.interfaces.snapshots import Snapshots
    from rom.report.html import write_report
    from rom.view.scenes.animation_files import write_animation
    from rom.workflow import mass_properties, modes, reduce, substructure

_one_thread_each()

__version__ = "0.1.0"

__all__ = [
    "Assembly",
    "Attachment",
    "BalancedTruncation",
    "Basis",
    "BladedWheel",
    "BodyFamily",
    "Characteristic",
    "ConfigError",
    "CraigBampton",
    "CyclicModes",
    "CyclicSector",
    "Density",
    "DualAssembly",
    "EnhancedCraigBampton",
    "FEModel",
    "FileFormatError",
    "FlexibleBody",
    "FourierLegendre",
    "FreeFree",
    "FreeSubstructure",
    "Guyan",
    "Heat",
    "Herting",
    "Interface",
    "InterfaceError",
    "InterruptedRun",
    "Keeping",
    "Layered",
    "Material",
    "MaterialError",
    "Mechanism",
    "MeshError",
    "MistunedWheel",
    "ModalDamping",
    "ModelError",
    "Modes",
    "ModesMissedError",
    "MomentMatching",
    "Orthotropic",
    "ParallelError",
    "ParameterError",
    "Polynomial",
    "QualityGateError",
    "Rayleigh",
    "ReducedBlade",
    "ReducedSpinUp",
    "Region",
    "Report",
    "ResourceError",
    "RomError",
    "RomWarning",
    "Rubin",
    "Snapshots",
    "SolverError",
    "SpinUp",
    "SpreadLoad",
    "SteadyMotion",
    "SurfaceMesh",
    "TagError",
    "Thickness",
    "TravellingModes",
    "UnsafeFileError",
    "WheelCampbell",
    "WithLoads",
    "YoungsModulus",
    "audit",
    "bladed_wheel",
    "campbell",
    "check",
    "craig_bampton",
    "cyclic_modes",
    "equilibrium",
    "equilibrium_sensitivity",
    "export",
    "frequency_response",
    "frequency_sensitivity",
    "heated",
    "heated_sector",
    "held_solid",
    "inverse_dynamics",
    "linearize",
    "load",
    "load_state",
    "mass_load",
    "mass_properties",
    "mistuned_wheel",
    "modes",
    "motion_sensitivity",
    "read_component",
    "read_mechanism",
    "read_model",
    "read_sid",
    "reduce",
    "reduce_parametric",
    "reduce_sector",
    "reduced_blade",
    "release",
    "rotating_sector",
    "save",
    "save_state",
    "second_order_balanced_truncation",
    "simulate",
    "spin_up",
    "steady_motion",
    "substructure",
    "substructured_sector",
    "supported_sector",
    "surface_load",
    "thermal_buckling",
    "transmissibility",
    "travelling_modes",
    "wheel_campbell",
    "write_animation",
    "write_body_fmu",
    "write_fmu",
    "write_history",
    "write_report",
    "write_stress",
    "write_stress_history",
]
PACKAGES = (
    "body", "components", "cyclic", "eigen", "errors", "fe", "io", "mbs", "model", "reduction",
    "rotation", "units", "view",
)  # fmt: skip
MODULES = {  # imported when a name is first used: asking for help must not load SciPy
    "Assembly": "assembly.assembly",
    "Attachment": "model",
    "BalancedTruncation": "reduction.bases.balanced",
    "Basis": "model",
    "BladedWheel": "cyclic.blades.bladed_wheel",
    "BodyFamily": "parametric.family",
    "Characteristic": "reduction.interfaces.characteristic",
    "ConfigError": "errors",
    "CraigBampton": "reduction.bases.method",
    "CyclicModes": "cyclic.modes",
    "CyclicSector": "cyclic.sector",
    "Density": "parametric.parameters",
    "DualAssembly": "assembly.dual",
    "EnhancedCraigBampton": "reduction.bases.enhanced",
    "FEModel": "model",
    "FileFormatError": "errors",
    "FlexibleBody": "body.flexible",
    "FourierLegendre": "reduction.interfaces.polynomial",
    "FreeFree": "reduction.bases.free_interface",
    "FreeSubstructure": "assembly.dual",
    "Guyan": "reduction.bases.method",
    "Heat": "prestress.heat",
    "Herting": "reduction.bases.free_interface",
    "Interface": "model",
    "InterfaceError": "errors",
    "InterruptedRun": "errors",
    "Keeping": "mbs.integrate.keeping",
    "Layered": "model",
    "Material": "model",
    "MaterialError": "errors",
    "Mechanism": "mbs.mechanism",
    "MeshError": "errors",
    "MistunedWheel": "cyclic.blades.mistuning",
    "ModalDamping": "body.damping",
    "ModelError": "errors",
    "Modes": "model",
    "ModesMissedError": "errors",
    "MomentMatching": "reduction.bases.krylov",
    "Orthotropic": "model",
    "ParallelError": "errors",
    "ParameterError": "errors",
    "Polynomial": "reduction.interfaces.polynomial",
    "QualityGateError": "errors",
    "Rayleigh": "body.damping",
    "ReducedBlade": "cyclic.blades.blade",
    "ReducedSpinUp": "prestress.speed_table",
    "Region": "model",
    "Report": "model",
    "ResourceError": "errors",
    "RomError": "errors",
    "RomWarning": "errors",
    "Rubin": "reduction.bases.free_interface",
    "Snapshots": "reduction.interfaces.snapshots",
    "SolverError": "errors",
    "SpinUp": "prestress.speed_table",
    "SpreadLoad": "body.spread",
    "SteadyMotion": "mbs.analysis.steady_motion",
    "SurfaceMesh": "model",
    "TagError": "errors",
    "Thickness": "parametric.parameters",
    "TravellingModes": "cyclic.travelling",
    "UnsafeFileError": "errors",
    "WheelCampbell": "cyclic.campbell",
    "WithLoads": "reduction.bases.loads",
    "YoungsModulus": "parametric.parameters",
    "audit": "mbs.results.audit",
    "bladed_wheel": "cyclic.blades.disk",
    "campbell": "mbs.analysis.campbell",
    "check": "checks.gates",
    "craig_bampton": "reduction.bases.fixed_interface",
    "cyclic_modes": "cyclic.modes",
    "equilibrium": "mbs.analysis.equilibrium",
    "equilibrium_sensitivity": "mbs.analysis.sensitivity",
    "export": "io.export",
    "frequency_response": "mbs.analysis.response",
    "frequency_sensitivity": "mbs.analysis.sensitivity",
    "heated": "prestress.thermal",
    "heated_sector": "prestress.thermal",
    "held_solid": "prestress.spin_up",
    "inverse_dynamics": "mbs.analysis.inverse_dynamics",
    "linearize": "mbs.analysis.linearize",
    "load": "io.family",
    "load_state": "mbs.results.checkpoint",
    "mass_load": "body.spread",
    "mass_properties": "workflow",
    "mistuned_wheel": "cyclic.blades.mistuning",
    "modes": "workflow",
    "motion_sensitivity": "mbs.analysis.sensitivity",
    "read_component": "config.component",
    "read_mechanism": "config.mechanism",
    "read_model": "io.matrices.read_model",
    "read_sid": "io.sid.dialect",
    "reduce": "workflow",
    "reduce_parametric": "parametric.reduce",
    "reduce_sector": "cyclic.reduced",
    "reduced_blade": "cyclic.blades.blade",
    "release": "mbs.integrate.release",
    "rotating_sector": "cyclic.rotation",
    "save": "io.family",
    "save_state": "mbs.results.checkpoint",
    "second_order_balanced_truncation": "reduction.bases.balanced",
    "simulate": "mbs.integrate.simulation",
    "spin_up": "prestress.spin_up",
    "steady_motion": "mbs.analysis.steady_motion",
    "substructure": "workflow",
    "substructured_sector": "cyclic.blades.substructured_sector",
    "supported_sector": "cyclic.supports",
    "surface_load": "body.spread",
    "thermal_buckling": "prestress.thermal",
    "transmissibility": "mbs.analysis.response",
    "travelling_modes": "cyclic.travelling",
    "wheel_campbell": "cyclic.campbell",
    "write_animation": "view.scenes.animation_files",
    "write_body_fmu": "io.fmu.body",
    "write_fmu": "fmu.export",
    "write_history": "io.history",
    "write_report": "report.html",
    "write_stress": "io.fields.vtu",
    "write_stress_history": "io.fields.vtu",
}


def __getattr__(name: str) -> "Any":
    """Import packages, and the modules of public names, on first use."""
    if name in PACKAGES:
        return importlib.import_module(f"rom.{name}")
    if name in MODULES:
        return getattr(importlib.import_module(f"rom.{MODULES[name]}"), name)
    raise AttributeError(f"module 'rom' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *PACKAGES})
