"""Force laws written in Python, asked between two calls of compiled code."""

from rom.mbs.elements.family import Asked
from rom.mbs.kernels.work import Work

Laws = tuple[Asked, ...]


def apply_laws(forces: Laws, W: Work, t: float, *, slopes: bool = False) -> None:
    """Let all laws answer for the motion at hand.

    Args:
        forces: the laws.
        W: memory with the motion.
        t: time [s].
        slopes: whether derivatives are needed too, as tangents follow.

    Raises:
        RomError: naming time and force if it fails, or a value is not finite.
    """
    for law in forces:
        law.apply(W, t, slopes=slopes)
