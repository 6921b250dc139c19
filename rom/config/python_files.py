"""Functions of Python files that a description names; they run only if they are trusted."""

import importlib.util
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from rom.arguments import Quantity
from rom.config.document import Document, KeyPath, Values
from rom.config.keys import Key, Place, Text, file_path, nearest
from rom.errors import RomError, UnsafeFileError
from rom.io.files import check_readable

Function = Callable[..., Any]  # of a file
NUMBERS = Quantity("1", ((None,),))
PYTHON_KEYS = (
    Key("file", file_path, "Python file.", ...),
    Key("function", Text(), "Name of a function in it.", ...),
    Key("parameters", NUMBERS, "Numbers handed to it behind its other arguments.", []),
)


def function_of(values: Values, place: Place, *, trust: bool) -> Function:
    """The function, with its parameters behind the other arguments."""
    function = plain_function_of(values, place, trust=trust)
    given = tuple(values["parameters"])
    return (lambda *arguments: function(*arguments, *given)) if given else function


def plain_function_of(values: Values, place: Place, *, trust: bool) -> Function:
    """The function alone; errors as of `function_of`."""
    path = check_readable(values["file"])
    check_trust(path, place, trust=trust)
    # run once for all functions that are named, and again when it has changed
    name = f"{path.stem} {sha256(path.read_bytes()).hexdigest()} of {path.resolve().parent}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            raise place.error(f"{path} is no Python file.", "Its name ends in .py.")
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException as error:
            del sys.modules[name]
            if isinstance(error, KeyboardInterrupt | RomError):
                raise
            hint = f"See that python {path.name} runs by itself."
            raise place.error(f"{path} cannot be run: {_summary(error, path)}.", hint) from error
    known = {
        key: one
        for key, one in vars(sys.modules[name]).items()
        if callable(one) and getattr(one, "__module__", None) == name
    }
    if values["function"] not in known:
        what = f"{path} has no function {values['function']!r}."
        raise place.error(what, nearest(values["function"], known))
    found: Function = known[values["function"]]
    return found


def check_trust(path: Path, place: Place, *, trust: bool) -> None:
    """Refuse a Python file that is not trusted."""
    if trust is not True:
        raise UnsafeFileError(
            f"{place.name}: {path} is a Python program, which can do to this machine whatever "
            "you can.",
            where=place.document.where(place.path),
            hint="Read it; if you trust it, run it with --trust or trust=True.",
        )


def python_entries(document: Document) -> Iterator[tuple[KeyPath, Path]]:
    """Path of the key and file of every function of a Python file in a document."""
    yield from _entries(document.data, (), document.path.parent)


def _entries(data: object, path: KeyPath, folder: Path) -> Iterator[tuple[KeyPath, Path]]:
    if not isinstance(data, Mapping):
        return
    if isinstance(data.get("file"), str) and "function" in data:
        yield (*path, "file"), folder / data["file"]
    for key, value in data.items():
        yield from _entries(value, (*path, str(key)), folder)


def _summary(error: BaseException, path: Path) -> str:
    own = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    line = f", line {own[-1].lineno}" if own else ""
    return f"{type(error).__name__}: {error}".rstrip(": .") + line
