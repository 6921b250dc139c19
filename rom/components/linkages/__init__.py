"""Linkages of two motors.

`two_dof_linkages` are the mechanisms, `dynamic_isotropy` says where both motors feel the same.
"""

from rom.lazy import front

front(__name__)
