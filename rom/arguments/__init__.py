"""Checks of what a user hands over: types by annotation, values by name.

`border` asks for the types of all arguments, `kinds` says what an annotation takes, `quantities`
are units and limits in annotations, `values` checks numbers, words, shapes and rotations.
"""

from rom.arguments.border import typed as typed
from rom.arguments.border import typed_record as typed_record
from rom.arguments.kinds import AnyBody as AnyBody
from rom.arguments.kinds import AnyFamily as AnyFamily
from rom.arguments.kinds import AnyMechanism as AnyMechanism
from rom.arguments.kinds import AnySector as AnySector
from rom.arguments.kinds import AnySolution as AnySolution
from rom.arguments.quantities import Angle as Angle
from rom.arguments.quantities import Ascending as Ascending
from rom.arguments.quantities import AtLeast as AtLeast
from rom.arguments.quantities import Between as Between
from rom.arguments.quantities import Count as Count
from rom.arguments.quantities import Direction as Direction
from rom.arguments.quantities import Length as Length
from rom.arguments.quantities import Modes as Modes
from rom.arguments.quantities import NotNegative as NotNegative
from rom.arguments.quantities import Number as Number
from rom.arguments.quantities import Omega as Omega
from rom.arguments.quantities import Orientation as Orientation
from rom.arguments.quantities import Point as Point
from rom.arguments.quantities import Positive as Positive
from rom.arguments.quantities import Quantity as Quantity
from rom.arguments.quantities import Share as Share
from rom.arguments.quantities import Size as Size
from rom.arguments.quantities import Velocity as Velocity
from rom.arguments.quantities import Whole as Whole
from rom.arguments.values import ascending as ascending
from rom.arguments.values import between as between
from rom.arguments.values import check_places as check_places
from rom.arguments.values import finite as finite
from rom.arguments.values import is_number as is_number
from rom.arguments.values import lowest as lowest
from rom.arguments.values import matrix as matrix
from rom.arguments.values import matrix33 as matrix33
from rom.arguments.values import not_both as not_both
from rom.arguments.values import not_negative as not_negative
from rom.arguments.values import number as number
from rom.arguments.values import one_each as one_each
from rom.arguments.values import one_given as one_given
from rom.arguments.values import one_of as one_of
from rom.arguments.values import orthonormal as orthonormal
from rom.arguments.values import plain as plain
from rom.arguments.values import positive as positive
from rom.arguments.values import rows_at as rows_at
from rom.arguments.values import shortened as shortened
from rom.arguments.values import start_pose as start_pose
from rom.arguments.values import symmetric as symmetric
from rom.arguments.values import unit_quaternion as unit_quaternion
from rom.arguments.values import unit_vector as unit_vector
from rom.arguments.values import vector as vector
from rom.arguments.values import whole as whole
