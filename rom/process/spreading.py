"""The same function of many things, by an executor of `concurrent.futures` where one is given."""

import os
import pickle
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from typing import Any, TypeVar

from rom.errors import ConfigError

Thing = TypeVar("Thing")
Value = TypeVar("Value")
ROUNDS = 4  # parts for each worker, so that none waits long for the last one
SEND = "Define it with def in a file that can be imported, without what cannot be pickled."


def spread(
    function: Callable[[Thing], Value], things: Sequence[Thing], executor: Executor | None = None
) -> list[Value]:
    """Values of the function in the order of things; what it holds goes over with each part.

    Raises:
        ConfigError: if the function cannot be sent to another process.
    """
    if executor is None:
        return [function(x) for x in things]
    workers: Any = getattr(executor, "_max_workers", os.cpu_count())
    size = -(-len(things) // (ROUNDS * workers))
    sent(function)
    return list(executor.map(function, things, chunksize=max(1, size)))


def sent(function: Callable[..., Any], name: str = "") -> bytes:
    """The function as another process gets it."""
    try:
        return pickle.dumps(function)
    except Exception as error:  # of whatever kind what it holds raises
        name = name or getattr(getattr(function, "func", function), "__qualname__", "function")
        text = f"{name!r} cannot be sent to another process: {error}."
        raise ConfigError(text, hint=SEND) from error
