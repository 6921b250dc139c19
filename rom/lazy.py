"""Fronts of packages: their names, whose modules are loaded when one is first asked for."""

import importlib
from collections.abc import Callable, Iterable
from typing import Any


def front(package: str, module: str, names: Iterable[str]) -> Callable[[str], Any]:
    """What a package says to names that it does not hold.

    Args:
        package: name of the package.
        module: of the package, where the names are.
        names: that it gives on.

    Returns:
        For ``__getattr__`` of the package.
    """
    given = frozenset(names)

    def named(name: str) -> Any:
        if name in given:
            return getattr(importlib.import_module(f"{package}.{module}"), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return named
