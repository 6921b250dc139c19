"""The public names of the package: the one place where each of them stands."""

from typing import Any

from rom import assembly as assembly
from rom import body as body
from rom import components as components
from rom import cyclic as cyclic
from rom import eigen as eigen
from rom import errors as errors
from rom import fe as fe
from rom import io as io
from rom import mbs as mbs
from rom import model as model
from rom import parametric as parametric
from rom import prestress as prestress
from rom import reduction as reduction
from rom import rotation as rotation
from rom import units as units
from rom import updating as updating
from rom import view as view
from rom.assembly.assembly import Assembly as Assembly
from rom.assembly.dual import DualAssembly as DualAssembly
from rom.assembly.dual import FreeSubstructure as FreeSubstructure
from rom.assembly.dual import substructure as substructure
from rom.assembly.pieces import Pieces as Pieces
from rom.assembly.pieces import reduce_pieces as reduce_pieces
from rom.body.damping import ModalDamping as ModalDamping
from rom.body.damping import Rayleigh as Rayleigh
from rom.body.flexible import FlexibleBody as FlexibleBody
from rom.body.nonlinear.ranges import Geometric as Geometric
from rom.body.spread import SpreadLoad as SpreadLoad
from rom.body.spread import mass_load as mass_load
from rom.body.spread import surface_load as surface_load
from rom.checks.gates import check as check
from rom.components.families.family import BodyFamily as BodyFamily
from rom.components.families.parameters import Density as Density
from rom.components.families.parameters import Thickness as Thickness
from rom.components.families.parameters import YoungsModulus as YoungsModulus
from rom.components.families.reduce import reduce_parametric as reduce_parametric
from rom.components.orbits.equilibria import continuation as continuation
from rom.components.orbits.motion import periodic_motion as periodic_motion
from rom.components.orbits.path import periodic_path as periodic_path
from rom.components.updating.estimate import update as update
from rom.components.wheels.blades.bladed_wheel import BladedWheel as BladedWheel
from rom.components.wheels.blades.disk import bladed_wheel as bladed_wheel
from rom.components.wheels.blades.mistuning import MistunedWheel as MistunedWheel
from rom.components.wheels.blades.mistuning import mistuned_wheel as mistuned_wheel
from rom.components.wheels.blades.substructured_sector import ReducedBlade as ReducedBlade
from rom.components.wheels.blades.substructured_sector import reduced_blade as reduced_blade
from rom.components.wheels.blades.substructured_sector import (
    substructured_sector as substructured_sector,
)
from rom.components.wheels.modes import CyclicModes as CyclicModes
from rom.components.wheels.modes import cyclic_modes as cyclic_modes
from rom.components.wheels.modes import wheel_modes as wheel_modes
from rom.components.wheels.prestress.spin_up import ReducedSpinUp as ReducedSpinUp
from rom.components.wheels.prestress.spin_up import SpinUp as SpinUp
from rom.components.wheels.prestress.spin_up import held_solid as held_solid
from rom.components.wheels.prestress.spin_up import spin_up as spin_up
from rom.components.wheels.prestress.thermal import Heat as Heat
from rom.components.wheels.prestress.thermal import heated as heated
from rom.components.wheels.prestress.thermal import heated_sector as heated_sector
from rom.components.wheels.prestress.thermal import thermal_buckling as thermal_buckling
from rom.components.wheels.reduced import reduce_sector as reduce_sector
from rom.components.wheels.rotation import rotating_sector as rotating_sector
from rom.components.wheels.rotation import supported_sector as supported_sector
from rom.components.wheels.sector import CyclicSector as CyclicSector
from rom.components.wheels.travelling import TravellingModes as TravellingModes
from rom.components.wheels.travelling import WheelCampbell as WheelCampbell
from rom.components.wheels.travelling import travelling_modes as travelling_modes
from rom.components.wheels.travelling import wheel_campbell as wheel_campbell
from rom.config.component import read_component as read_component
from rom.config.examples import example as example
from rom.config.mechanism import read_mechanism as read_mechanism
from rom.config.mechanism_fmu import write_mechanism_fmu as write_mechanism_fmu
from rom.errors import ConfigError as ConfigError
from rom.errors import FileFormatError as FileFormatError
from rom.errors import InterfaceError as InterfaceError
from rom.errors import InterruptedRun as InterruptedRun
from rom.errors import MaterialError as MaterialError
from rom.errors import MeshError as MeshError
from rom.errors import ModelError as ModelError
from rom.errors import ModesMissedError as ModesMissedError
from rom.errors import ParallelError as ParallelError
from rom.errors import ParameterError as ParameterError
from rom.errors import QualityGateError as QualityGateError
from rom.errors import ResourceError as ResourceError
from rom.errors import RomError as RomError
from rom.errors import RomWarning as RomWarning
from rom.errors import SolverError as SolverError
from rom.errors import TagError as TagError
from rom.errors import UnknownNameError as UnknownNameError
from rom.errors import UnsafeFileError as UnsafeFileError
from rom.fmu.export import write_fmu as write_fmu
from rom.io.bodies import load as load
from rom.io.bodies import save as save
from rom.io.export import export as export
from rom.io.fields.vtu import write_stress as write_stress
from rom.io.fields.vtu import write_stress_history as write_stress_history
from rom.io.fmu.body import write_body_fmu as write_body_fmu
from rom.io.history import write_history as write_history
from rom.io.matrices.read_model import read_model as read_model
from rom.io.sid.dialect import read_sid as read_sid
from rom.mbs.analysis.campbell import campbell as campbell
from rom.mbs.analysis.equilibrium import equilibrium as equilibrium
from rom.mbs.analysis.inverse_dynamics import inverse_dynamics as inverse_dynamics
from rom.mbs.analysis.law_check import check_law as check_law
from rom.mbs.analysis.linearize import linearize as linearize
from rom.mbs.analysis.local_equations import snapshot as snapshot
from rom.mbs.analysis.response import frequency_response as frequency_response
from rom.mbs.analysis.response import transmissibility as transmissibility
from rom.mbs.analysis.sensitivity import equilibrium_sensitivity as equilibrium_sensitivity
from rom.mbs.analysis.sensitivity import frequency_sensitivity as frequency_sensitivity
from rom.mbs.analysis.sensitivity import motion_sensitivity as motion_sensitivity
from rom.mbs.analysis.steady_motion import SteadyMotion as SteadyMotion
from rom.mbs.analysis.steady_motion import steady_motion as steady_motion
from rom.mbs.control.stepper import Stepper as Stepper
from rom.mbs.integrate.keeping import Keeping as Keeping
from rom.mbs.integrate.simulation import release as release
from rom.mbs.integrate.simulation import simulate as simulate
from rom.mbs.mechanism import Mechanism as Mechanism
from rom.mbs.results.audit import audit as audit
from rom.mbs.results.state import load_state as load_state
from rom.mbs.results.state import save_state as save_state
from rom.model import Attachment as Attachment
from rom.model import Basis as Basis
from rom.model import FEModel as FEModel
from rom.model import Interface as Interface
from rom.model import Layered as Layered
from rom.model import Material as Material
from rom.model import Modes as Modes
from rom.model import Orthotropic as Orthotropic
from rom.model import Region as Region
from rom.model import Report as Report
from rom.model import SurfaceMesh as SurfaceMesh
from rom.reduction.bases.assumed import AssumedModes as AssumedModes
from rom.reduction.bases.balanced import BalancedTruncation as BalancedTruncation
from rom.reduction.bases.balanced import (
    second_order_balanced_truncation as second_order_balanced_truncation,
)
from rom.reduction.bases.fixed_interface import craig_bampton as craig_bampton
from rom.reduction.bases.free_interface import FreeFree as FreeFree
from rom.reduction.bases.free_interface import Herting as Herting
from rom.reduction.bases.free_interface import Rubin as Rubin
from rom.reduction.bases.krylov import MomentMatching as MomentMatching
from rom.reduction.bases.method import CraigBampton as CraigBampton
from rom.reduction.bases.method import EnhancedCraigBampton as EnhancedCraigBampton
from rom.reduction.bases.method import Guyan as Guyan
from rom.reduction.bases.method import WithLoads as WithLoads
from rom.reduction.full_model import mass_properties as mass_properties
from rom.reduction.full_model import modes as modes
from rom.reduction.interfaces.characteristic import Characteristic as Characteristic
from rom.reduction.interfaces.polynomial import FourierLegendre as FourierLegendre
from rom.reduction.interfaces.polynomial import Polynomial as Polynomial
from rom.reduction.interfaces.snapshots import Snapshots as Snapshots
from rom.report.html import write_report as write_report
from rom.report.pieces import certify_pieces as certify_pieces
from rom.view.scenes.animation_files import write_animation as write_animation
from rom.workflow import reduce as reduce

__version__: str
__all__: list[str]
PACKAGES: tuple[str, ...]
MODULES: dict[str, str]

def __getattr__(name: str) -> Any: ...
