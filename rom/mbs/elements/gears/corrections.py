"""Corrections and errors of tooth flanks."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Correction:
    """What is taken off the flanks of a pair.

    Attributes:
        relief: (2,) depth at the tips of pinion and gear [m].
        extent: (2,) length of the relief along the path of contact [m].
        power: 1 for linear, 2 for parabolic relief [1].
        crowning: at both ends of the face [m].
        slope: of the lead, gap at z = +width/2 less gap at -width/2 [m].
        pitch: errors of the teeth of pinion and gear [m]; positive leaves a gap.
    """

    relief: tuple[float, float] = (0.0, 0.0)
    extent: tuple[float, float] = (0.0, 0.0)
    power: float = 1.0
    crowning: float = 0.0
    slope: float = 0.0
    pitch: tuple[Any, Any] = ((), ())
