"""What was written otherwise in earlier versions, and is understood for one minor version more."""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from rom.errors import warn

P = ParamSpec("P")
R = TypeVar("R")


def path_came_first(*order: int, suffix: str = "") -> Callable[[Callable[P, R]], Callable[P, R]]:
    """For a function of things and then a path that once took the path before them.

    Args:
        order: where each argument of now stood in an earlier version.
        suffix: of the path, where the first thing is a path, too.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        now = dict(zip(order, signature(function).parameters, strict=False))
        before = [now[place] for place in range(len(order))]

        @wraps(function)
        def called(*args: Any, **named: Any) -> R:
            first = args[0] if args else None
            earlier = isinstance(first, str | Path) and str(first).endswith(suffix)
            if earlier and len(args) <= len(order) and not {*before[: len(args)]} & {*named}:
                text = f"{function.__name__} takes the path behind what is drawn or written now."
                warn(text, DeprecationWarning)
                args, named = (), named | dict(zip(before, args, strict=False))
            return function(*args, **named)

        return called

    return decorate


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """For a function whose arguments once had other names.

    Args:
        names: the name of now for each one of an earlier version.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def called(*args: Any, **named: Any) -> R:
            for before, now in names.items():
                if before in named and now not in named:
                    text = f"the argument {before} of {function.__name__} is called {now} now."
                    warn(text, DeprecationWarning)
                    named[now] = named.pop(before)
            return function(*args, **named)

        return called

    return decorate
