"""One fault: what is done, what may come of it, what names the culprit; and all faults by class."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

CLASSES = {  # number of the class: its module
    "6": "files",  # and lines, also of several mistakes at once
    "7": "bounds",
    "8": "together",  # alone and beside others
    "R": "models",
}


class Works:
    """The fault does no harm: the call returns, and what the case itself requires holds."""


def require(holds: object, what: object) -> None:
    assert holds, what


@dataclass(frozen=True)
class Case:
    """A fault."""

    name: str  # what is wrong, unique in its class
    act: str | Callable[[Path], Any]  # a command line behind ``rom``, or a function of the folder
    accept: tuple[type, ...]  # error classes or `Works`
    words: tuple[str | tuple[str, ...], ...] = ()  # all stand in the message, of a tuple one
    given: tuple[Callable[[Path], object], ...] = field(default=(), repr=False)  # before it
    fe: bool = False  # needs FEniCSx
    leaves: bool = False  # files may stay although an error is raised


def case(name: str, act: Any, accept: Any, *words: Any, given: Any = (), **options: Any) -> Case:
    """A case; single outcomes and preparations need no tuple."""
    accept = accept if isinstance(accept, tuple) else (accept,)
    given = (given,) if callable(given) else tuple(given)
    return Case(name, act, accept, words, given, **options)


def edit(name: str, old: str, new: str) -> Callable[[Path], object]:
    """Replaces a text in a file, which must be there."""

    def prepare(folder: Path) -> None:
        content = (folder / name).read_text()
        assert old in content, f"{name} has no {old!r}"
        (folder / name).write_text(content.replace(old, new, 1))

    return prepare


def write(name: str, content: str | bytes) -> Callable[[Path], object]:
    data = content if isinstance(content, bytes) else content.encode()
    return lambda folder: (folder / name).write_bytes(data)


def all_cases() -> dict[str, Case]:
    """The cases by "class:name", in order."""
    found: dict[str, Case] = {}
    for letter, module in CLASSES.items():
        for one in import_module(f"generated.cases_{module}").CASES:
            assert f"{letter}:{one.name}" not in found, f"{letter}:{one.name} is there twice"
            found[f"{letter}:{one.name}"] = one
    return found
