"""Checks of what a user hands over: types by annotation, values by name."""

from rom.arguments.border import typed
from rom.arguments.kinds import AnyBody, AnyMechanism, AnySolution
from rom.arguments.values import (
    finite,
    matrix33,
    number,
    one_of,
    positive,
    shortened,
    start_pose,
    unit_quaternion,
    unit_vector,
    whole,
)

__all__ = [
    "AnyBody",
    "AnyMechanism",
    "AnySolution",
    "finite",
    "matrix33",
    "number",
    "one_of",
    "positive",
    "shortened",
    "start_pose",
    "typed",
    "unit_quaternion",
    "unit_vector",
    "whole",
]
