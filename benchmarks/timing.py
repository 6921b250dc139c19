"""Time of the processor, and the figures it goes into."""

from collections.abc import Callable
from time import process_time
from typing import Any

Row = tuple[str, str, float, str, str]  # case, quantity, value, unit and aim


def timed(work: Callable[..., Any], *arguments: Any, **named: Any) -> tuple[float, Any]:
    """Processor time [s], and what came of it."""
    start = process_time()
    found = work(*arguments, **named)
    return process_time() - start, found
