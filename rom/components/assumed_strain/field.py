"""What sheets of metal have for the doctor."""

import numpy as np

from rom.fields import Field

FIELD = Field(first_use={"assumed_strain": "rom.components.assumed_strain.field:first_use"})


def first_use() -> None:
    """Metal that flows, and a tangent."""
    from rom.components.assumed_strain import Metal, fly, rectangle, sheet, tangent

    copper = Metal(117e9, 0.35, 8930.0, yield_stress=400e6, hardening=100e6)
    X, triangles = rectangle((1, 1), [(0, 0), (1, 0), (1, 1), (0, 1)])
    bar = sheet(X, triangles, element="F1", state="axisymmetric")
    fly(bar, copper, np.full(X.shape, -1.0), np.array([0, 1]), 1e-8)
    tangent(sheet(X, triangles), copper, X)
