"""Checks of what a user hands over: types by annotation, values by name.

`border` asks for the types of all arguments, `kinds` says what an annotation takes, `values` checks
numbers, words, shapes and rotations.
"""

from rom.arguments.border import typed
from rom.arguments.kinds import AnyBody, AnyFamily, AnyMechanism, AnySector, AnySolution
from rom.arguments.values import (
    between,
    finite,
    is_number,
    lowest,
    matrix,
    matrix33,
    not_negative,
    number,
    one_each,
    one_of,
    positive,
    rows_at,
    shortened,
    start_pose,
    symmetric,
    unit_quaternion,
    unit_vector,
    vector,
    whole,
)

__all__ = [
    "AnyBody",
    "AnyFamily",
    "AnyMechanism",
    "AnySector",
    "AnySolution",
    "between",
    "finite",
    "is_number",
    "lowest",
    "matrix",
    "matrix33",
    "not_negative",
    "number",
    "one_each",
    "one_of",
    "positive",
    "rows_at",
    "shortened",
    "start_pose",
    "symmetric",
    "typed",
    "unit_quaternion",
    "unit_vector",
    "vector",
    "whole",
]
