"""Reduced-order flexible bodies: finite elements in, floating-frame multibody models out.

Importing ``rom`` needs NumPy, SciPy and Numba only. Everything that needs dolfinx, PETSc or gmsh
lives in ``rom.fe`` and is imported when it is first used.
"""

# Nothing is imported here that Python has not loaded itself: `python -m rom` comes by before
# `rom.__main__` can take the working folder off the path, and a typing.py may lie in it.
import importlib
import os

from rom.launcher import one_thread_each as _one_thread_each

# Empty is the default; it wins over a .numba_config.yaml in the working folder, by which Numba
# would load compiled code from wherever that file says.
for _name in ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES"):
    os.environ.setdefault(_name, "")

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from rom.body.assembly import Assembly
    from rom.body.damping import ModalDamping, Rayleigh
    from rom.body.family import BodyFamily
    from rom.body.flexible import FlexibleBody
    from rom.body.spread import SpreadLoad, mass_load, surface_load
    from rom.checks import check
    from rom.config.component import read_component
    from rom.config.mechanism import read_mechanism
    from rom.cyclic.bladed_wheel import BladedWheel
    from rom.cyclic.bladeless_disk import bladed_wheel
    from rom.cyclic.blades import ReducedBlade, reduced_blade
    from rom.cyclic.campbell import WheelCampbell, wheel_campbell
    from rom.cyclic.mistuning import MistunedWheel, mistuned_wheel
    from rom.cyclic.modes import CyclicModes, cyclic_modes
    from rom.cyclic.reduced import reduce_sector
    from rom.cyclic.rotation import rotating_sector
    from rom.cyclic.sector import CyclicSector
    from rom.cyclic.springs import supported_sector
    from rom.cyclic.substructures import substructured_sector
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
    from rom.io.fmu.body import write_body_fmu
    from rom.io.foreign_model import read_model
    from rom.io.history import write_history
    from rom.io.sid_dialect import read_sid
    from rom.io.vtu import write_stress, write_stress_history
    from rom.mbs.audit import audit
    from rom.mbs.campbell import campbell
    from rom.mbs.checkpoint import load_state, save_state
    from rom.mbs.equilibrium import equilibrium
    from rom.mbs.integrate import simulate
    from rom.mbs.inverse import inverse_dynamics
    from rom.mbs.keeping import Keeping
    from rom.mbs.linearize import linearize
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.release import release
    from rom.mbs.response import frequency_response, transmissibility
    from rom.mbs.sensitivity import (
        equilibrium_sensitivity,
        frequency_sensitivity,
        motion_sensitivity,
    )
    from rom.mbs.steady import SteadyMotion, steady_motion
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
    from rom.parameters import Density, Thickness, YoungsModulus
    from rom.parametric.reduce import reduce_parametric
    from rom.prestress.heat import Heat
    from rom.prestress.spin_up import held_solid, spin_up
    from rom.prestress.states import ReducedSpinUp, SpinUp
    from rom.prestress.thermal import heated, heated_sector, thermal_buckling
    from rom.reduction.balanced import BalancedTruncation, second_order_balanced_truncation
    from rom.reduction.characteristic import Characteristic
    from rom.reduction.dual import DualAssembly, FreeSubstructure
    from rom.reduction.enhanced import EnhancedCraigBampton
    from rom.reduction.fixed_interface import craig_bampton
    from rom.reduction.free_interface import FreeFree, Herting, Rubin
    from rom.reduction.krylov import MomentMatching
    from rom.reduction.loads import WithLoads
    from rom.reduction.method import CraigBampton, Guyan
    from rom.reduction.polynomial import FourierLegendre, Polynomial
    from rom.reduction.snapshots import Snapshots
    from rom.report import write_report
    from rom.view.motion import write_animation
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
    "Assembly": "body.assembly",
    "Attachment": "model",
    "BalancedTruncation": "reduction.balanced",
    "Basis": "model",
    "BladedWheel": "cyclic.bladed_wheel",
    "BodyFamily": "body.family",
    "Characteristic": "reduction.characteristic",
    "ConfigError": "errors",
    "CraigBampton": "reduction.method",
    "CyclicModes": "cyclic.modes",
    "CyclicSector": "cyclic.sector",
    "Density": "parameters",
    "DualAssembly": "reduction.dual",
    "EnhancedCraigBampton": "reduction.enhanced",
    "FEModel": "model",
    "FileFormatError": "errors",
    "FlexibleBody": "body.flexible",
    "FourierLegendre": "reduction.polynomial",
    "FreeFree": "reduction.free_interface",
    "FreeSubstructure": "reduction.dual",
    "Guyan": "reduction.method",
    "Heat": "prestress.heat",
    "Herting": "reduction.free_interface",
    "Interface": "model",
    "InterfaceError": "errors",
    "InterruptedRun": "errors",
    "Keeping": "mbs.keeping",
    "Layered": "model",
    "Material": "model",
    "MaterialError": "errors",
    "Mechanism": "mbs.mechanism",
    "MeshError": "errors",
    "MistunedWheel": "cyclic.mistuning",
    "ModalDamping": "body.damping",
    "ModelError": "errors",
    "Modes": "model",
    "ModesMissedError": "errors",
    "MomentMatching": "reduction.krylov",
    "Orthotropic": "model",
    "ParallelError": "errors",
    "ParameterError": "errors",
    "Polynomial": "reduction.polynomial",
    "QualityGateError": "errors",
    "Rayleigh": "body.damping",
    "ReducedBlade": "cyclic.blades",
    "ReducedSpinUp": "prestress.states",
    "Region": "model",
    "Report": "model",
    "ResourceError": "errors",
    "RomError": "errors",
    "RomWarning": "errors",
    "Rubin": "reduction.free_interface",
    "Snapshots": "reduction.snapshots",
    "SolverError": "errors",
    "SpinUp": "prestress.states",
    "SpreadLoad": "body.spread",
    "SteadyMotion": "mbs.steady",
    "SurfaceMesh": "model",
    "TagError": "errors",
    "Thickness": "parameters",
    "TravellingModes": "cyclic.travelling",
    "UnsafeFileError": "errors",
    "WheelCampbell": "cyclic.campbell",
    "WithLoads": "reduction.loads",
    "YoungsModulus": "parameters",
    "audit": "mbs.audit",
    "bladed_wheel": "cyclic.bladeless_disk",
    "campbell": "mbs.campbell",
    "check": "checks",
    "craig_bampton": "reduction.fixed_interface",
    "cyclic_modes": "cyclic.modes",
    "equilibrium": "mbs.equilibrium",
    "equilibrium_sensitivity": "mbs.sensitivity",
    "export": "io.export",
    "frequency_response": "mbs.response",
    "frequency_sensitivity": "mbs.sensitivity",
    "heated": "prestress.thermal",
    "heated_sector": "prestress.thermal",
    "held_solid": "prestress.spin_up",
    "inverse_dynamics": "mbs.inverse",
    "linearize": "mbs.linearize",
    "load": "io.family",
    "load_state": "mbs.checkpoint",
    "mass_load": "body.spread",
    "mass_properties": "workflow",
    "mistuned_wheel": "cyclic.mistuning",
    "modes": "workflow",
    "motion_sensitivity": "mbs.sensitivity",
    "read_component": "config.component",
    "read_mechanism": "config.mechanism",
    "read_model": "io.foreign_model",
    "read_sid": "io.sid_dialect",
    "reduce": "workflow",
    "reduce_parametric": "parametric.reduce",
    "reduce_sector": "cyclic.reduced",
    "reduced_blade": "cyclic.blades",
    "release": "mbs.release",
    "rotating_sector": "cyclic.rotation",
    "save": "io.family",
    "save_state": "mbs.checkpoint",
    "second_order_balanced_truncation": "reduction.balanced",
    "simulate": "mbs.integrate",
    "spin_up": "prestress.spin_up",
    "steady_motion": "mbs.steady",
    "substructure": "workflow",
    "substructured_sector": "cyclic.substructures",
    "supported_sector": "cyclic.springs",
    "surface_load": "body.spread",
    "thermal_buckling": "prestress.thermal",
    "transmissibility": "mbs.response",
    "travelling_modes": "cyclic.travelling",
    "wheel_campbell": "cyclic.campbell",
    "write_animation": "view.motion",
    "write_body_fmu": "io.fmu.body",
    "write_fmu": "fmu.export",
    "write_history": "io.history",
    "write_report": "report",
    "write_stress": "io.vtu",
    "write_stress_history": "io.vtu",
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
