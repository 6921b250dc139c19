"""Updating of a model by measured frequency responses, after Berriet, Fillod and Bouhaddi.

Unknown are relative changes of stiffness and mass and the damping ratios of the modes. The model
can be condensed to the sensors, and test and model together to one common basis.
"""

from rom.components.updating.methods import (
    Update,
    common_basis,
    response_function_method,
    responses,
    sensitivity,
    update_by_input,
    update_by_output,
)
from rom.components.updating.models import (
    AtSensors,
    Measurement,
    Modal,
    Model,
    ParametricModel,
    damping_matrix,
    modal,
    parametric_basis,
)

__all__ = [
    "AtSensors",
    "Measurement",
    "Modal",
    "Model",
    "ParametricModel",
    "Update",
    "common_basis",
    "damping_matrix",
    "modal",
    "parametric_basis",
    "response_function_method",
    "responses",
    "sensitivity",
    "update_by_input",
    "update_by_output",
]
