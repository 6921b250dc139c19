"""Force laws written in Python, asked between two calls of compiled code."""

from typing import Any

from rom.mbs.elements.family import Asked
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Work

Laws = tuple[Asked, ...]


def laws(_mechanism: Any, packed: Packed) -> Laws:
    """The laws of a mechanism that stay in Python."""
    return packed.asked


def apply_laws(forces: Laws, W: Work, t: float) -> None:
    """Let all laws answer for the motion at hand.

    Raises:
        RomError: naming time and force if it fails, or a value is not finite.
    """
    for law in forces:
        law.apply(W, t)
