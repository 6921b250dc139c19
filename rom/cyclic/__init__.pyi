from rom.components.wheels.blades.bladed_wheel import BladedWheel as BladedWheel
from rom.components.wheels.blades.bladed_wheel import GyroscopicModes as GyroscopicModes
from rom.components.wheels.blades.bladed_wheel import gyroscopic_modes as gyroscopic_modes
from rom.components.wheels.blades.disk import bladed_wheel as bladed_wheel
from rom.components.wheels.blades.mistuning import MistunedWheel as MistunedWheel
from rom.components.wheels.blades.mistuning import mistuned_wheel as mistuned_wheel
from rom.components.wheels.blades.mistuning import whitehead as whitehead
from rom.components.wheels.blades.substructured_sector import ReducedBlade as ReducedBlade
from rom.components.wheels.blades.substructured_sector import (
    SubstructuredSector as SubstructuredSector,
)
from rom.components.wheels.blades.substructured_sector import reduced_blade as reduced_blade
from rom.components.wheels.blades.substructured_sector import (
    substructured_sector as substructured_sector,
)
from rom.components.wheels.modes import CyclicModes as CyclicModes
from rom.components.wheels.modes import cyclic_modes as cyclic_modes
from rom.components.wheels.modes import wheel_modes as wheel_modes
from rom.components.wheels.reduced import ReducedSector as ReducedSector
from rom.components.wheels.reduced import reduce_sector as reduce_sector
from rom.components.wheels.rotation import centrifugal_displacement as centrifugal_displacement
from rom.components.wheels.rotation import divergence_speed as divergence_speed
from rom.components.wheels.rotation import rotating_sector as rotating_sector
from rom.components.wheels.rotation import rotation_matrices as rotation_matrices
from rom.components.wheels.rotation import supported_sector as supported_sector
from rom.components.wheels.sector import CyclicSector as CyclicSector
from rom.components.wheels.travelling import TravellingModes as TravellingModes
from rom.components.wheels.travelling import WheelCampbell as WheelCampbell
from rom.components.wheels.travelling import travelling_modes as travelling_modes
from rom.components.wheels.travelling import wheel_campbell as wheel_campbell
