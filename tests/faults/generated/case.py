"""One fault: what is done, what may come of it, what names the culprit; and all faults by class."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

SECONDS = 60.0  # a case may take, on a machine that does other things too

CLASSES = {  # number of the class: what it is about, and its modules
    "1": ("code from the working folder", ("cases_code",)),
    "2": ("names as paths", ("cases_names",)),
    "3": ("geometries as programs", ("cases_geometry",)),
    "4": ("motion lost", ("cases_motion",)),
    "5": ("silent wrong physics", ("cases_physics",)),
    "6": ("blame", ("cases_files",)),
    "7": ("bounds", ("cases_bounds",)),
    "8": ("alone and together", ("cases_together",)),
    "R": ("odd cases of the reliability table", ("cases_reliability",)),
}


class Works:
    """The fault does no harm: the call returns, and what the case itself requires holds."""


class Warned:
    """The call returns, with a `RomWarning` that has the words."""


class Silent:
    """The call returns, and warns of nothing."""


class Wrong(Exception):
    """The call returned something it must not."""


def require(holds: object, what: str) -> None:
    """Refuse a result."""
    if not holds:
        raise Wrong(what)


@dataclass(frozen=True)
class Case:
    """A fault.

    Attributes:
        name: what is wrong, unique in its class.
        act: a command line behind ``rom``, or a function of the working folder.
        accept: error classes, `Works`, `Warned` or `Silent`.
        words: all must stand in the message; of a tuple one will do.
        given: functions of the folder that prepare it.
        fe: whether it needs FEniCSx.
        leaves: whether files may stay although an error is raised.
        seconds: it may take.
    """

    name: str
    act: str | Callable[[Path], Any]
    accept: tuple[type, ...]
    words: tuple[str | tuple[str, ...], ...] = ()
    given: tuple[Callable[[Path], object], ...] = field(default=(), repr=False)
    fe: bool = False
    leaves: bool = False
    seconds: float = SECONDS


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
    """Writes a file."""
    data = content if isinstance(content, bytes) else content.encode()
    return lambda folder: (folder / name).write_bytes(data)


def changed(name: str, change: Callable[[bytes], bytes]) -> Callable[[Path], object]:
    """Replaces the bytes of a file by what a function makes of them."""
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes()))


def cut(name: str, share: float) -> Callable[[Path], object]:
    """A file of which only this share is there."""
    return changed(name, lambda data: data[: int(share * len(data))])


def mutated(name: str, way: Any, seed: int) -> Callable[[Path], object]:
    """A file damaged at random."""
    return changed(name, lambda data: way(data, np.random.default_rng(seed)))


def arrays_changed(name: str, change: Callable[[dict[str, Any]], object]) -> Any:
    """Changes arrays of a body file behind the back of its checksums, as another program would."""

    def prepare(folder: Path) -> None:
        with np.load(folder / name) as found:
            arrays = dict(found)
        change(arrays)
        np.savez(folder / name, **arrays)

    return prepare


def geometry(line: str) -> Callable[[Path], object]:
    """One more statement in the geometry of the stock."""
    return edit("box.geo", "Mesh.MeshSizeMin", f"{line}\nMesh.MeshSizeMin")


def by_id(letter: str, cases: Iterable[Case]) -> dict[str, Case]:
    """The cases of a class by "class:name"."""
    found = {}
    for one in cases:
        assert f"{letter}:{one.name}" not in found, f"{letter}:{one.name} is there twice"
        found[f"{letter}:{one.name}"] = one
    return found


def all_cases() -> dict[str, Case]:
    """{id: case}, in order."""
    found: dict[str, Case] = {}
    for letter, (_, modules) in CLASSES.items():
        cases = [one for m in modules for one in import_module(f"generated.{m}").CASES]
        found |= by_id(letter, cases)
    return found


def planted() -> dict[str, Case]:
    """Cases whose verdict is known, for the test of the judge."""
    return by_id("J", import_module("generated.judge").MISTAKES)
