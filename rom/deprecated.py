"""What was written otherwise in earlier versions, and is understood for one minor version more."""

import warnings
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def path_came_first(*order: int, suffix: str = "") -> Callable[[Callable[P, R]], Callable[P, R]]:
    """For a function of things and then a path that once took the path before them.

    Args:
        order: where each argument of now stood in an earlier version.
        suffix: of the path, where the first thing is a path, too.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def called(*args: Any, **named: Any) -> R:
            first = args[0] if args else None
            earlier = isinstance(first, str | Path) and str(first).endswith(suffix)
            if earlier and len(args) >= len(order):
                args = (*(args[k] for k in order), *args[len(order) :])
                text = f"{function.__name__} takes the path behind what is drawn or written now."
                warnings.warn(text, DeprecationWarning, stacklevel=2)
            return function(*args, **named)

        return called

    return decorate
