from rom.components.updating.comparison import Comparison as Comparison
from rom.components.updating.comparison import compare as compare
from rom.components.updating.family_model import AddedMass as AddedMass
from rom.components.updating.family_model import GroundSpring as GroundSpring
from rom.components.updating.family_model import JointSpring as JointSpring
from rom.components.updating.measured import Channels as Channels
from rom.components.updating.measured import MeasuredModes as MeasuredModes
from rom.components.updating.measured import Responses as Responses
from rom.components.updating.observers.operation import Sensors as Sensors
from rom.components.updating.observers.parameter_tracking import Drift as Drift
from rom.components.updating.observers.parameter_tracking import (
    ParameterTracker as ParameterTracker,
)
from rom.components.updating.observers.parameter_tracking import (
    parameter_tracker as parameter_tracker,
)
from rom.components.updating.observers.tracking import Observer as Observer
from rom.components.updating.observers.tracking import Track as Track
from rom.components.updating.observers.tracking import Tracker as Tracker
from rom.components.updating.observers.tracking import tracker as tracker
from rom.components.updating.placement import Plan as Plan
from rom.components.updating.placement import candidates as candidates
from rom.components.updating.placement import independent as independent
from rom.components.updating.placement import place as place
from rom.components.updating.verdict import Updated as Updated
