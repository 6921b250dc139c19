"""Force laws written in Python, asked between two calls of compiled code."""

import numpy as np

from rom.mbs.elements.family import Asked
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Work
from rom.mbs.mechanism import Mechanism

Laws = tuple[Asked, ...]


def apply_laws(forces: Laws, W: Work, t: float) -> None:
    """Let all laws answer for the motion at hand.

    Raises:
        RomError: naming time and force if it fails, or a value is not finite.
    """
    for law in forces:
        law.apply(W, t)


def broken_laws(mechanism: Mechanism, packed: Packed) -> str:
    """The elements whose laws gave something else than finite numbers when asked last, in words."""
    names = [
        name
        for family, elements in mechanism.families().items()
        for name, answer in zip(elements, family.answers(packed.elements[family]), strict=False)
        if not np.isfinite(answer).all()
    ]
    return f"; the law of {', '.join(map(repr, names))} gives no finite number" if names else ""
