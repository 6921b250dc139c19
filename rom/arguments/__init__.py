"""Checks of what a user hands over: types by annotation, values by name.

`border` asks for the types of all arguments, `kinds` says what an annotation takes, `values` checks
numbers, words, shapes and rotations.
"""

from rom.arguments.border import typed
from rom.arguments.kinds import AnyBody, AnyMechanism, AnySolution
from rom.arguments.values import (
    finite,
    is_number,
    lowest,
    matrix,
    matrix33,
    number,
    one_of,
    positive,
    rows_at,
    shortened,
    start_pose,
    unit_quaternion,
    unit_vector,
    vector,
    whole,
)

__all__ = [
    "AnyBody",
    "AnyMechanism",
    "AnySolution",
    "finite",
    "is_number",
    "lowest",
    "matrix",
    "matrix33",
    "number",
    "one_of",
    "positive",
    "rows_at",
    "shortened",
    "start_pose",
    "typed",
    "unit_quaternion",
    "unit_vector",
    "vector",
    "whole",
]
