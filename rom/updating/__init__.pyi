from rom.updating.estimate import Updated as Updated
from rom.updating.family_model import AddedMass as AddedMass
from rom.updating.family_model import GroundSpring as GroundSpring
from rom.updating.measured import Channels as Channels
from rom.updating.measured import MeasuredModes as MeasuredModes
from rom.updating.measured import Responses as Responses
