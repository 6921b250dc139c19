"""Quality gates, and what a reduction lost.

`gates` checks models and bodies row by row, `certificate` compares full with reduced.
"""

from rom.lazy import front

__all__ = ["check", "check_body", "check_model"]
__getattr__ = front(__name__, "gates", __all__)
