"""Fields of engineering: what each has for the rest, which imports none and runs with none.

A field is a folder with its elements, keys, symbols, columns and verbs, and a record that says by
import strings, "module:name", where they are. Nothing is imported before somebody asks for it.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rom.errors import UnknownNameError, warn

if TYPE_CHECKING:  # what fields give to mechanisms and solutions, as types
    from rom.components.methods import Columns as Columns
    from rom.components.methods import Methods as Methods
else:
    Methods = Columns = object

# The list: the modules of all records, in the order of tables for compiled code; and, of fields
# that may be missing, the names by which they are asked for, or that of the folder
FIELDS = {
    "rom.mbs.elements.field": "",
    "rom.components.tendons.field": "tendon tendons",
    "rom.components.gear_mesh.field": "gear_mesh gear_meshes",
    "rom.components.rolling_bearing.field": "rolling_bearing rolling_bearings",
    "rom.components.journal_bearing.field": "journal_bearing journal_bearings",
    "rom.components.round_bodies.field": "spin",
    "rom.components.cosserat.field": "rods",
    "rom.components.assumed_strain.field": "assumed_strain",
    "rom.components.co_simulation.field": "fmu",
    "rom.components.best_matching.field": "best_matching",
    "rom.components.families.field": "save.BodyFamily load.rom-family",
    "rom.components.linkages.field": "linkages",
    "rom.components.masonry.field": "masonry",
    "rom.components.orbits.field": "orbits",
    "rom.components.rockfall.field": "rockfall",
    "rom.components.studies.field": "study",
    "rom.components.updating.field": "update",
    "rom.components.wheels.field": "reduce.CyclicSector",
    "rom.components.wind.field": "wind",
}
ENTRY_POINT_GROUP = "rom.fields"  # of entry points, by which other packages bring theirs


@dataclass(frozen=True, slots=True)
class Field:
    """What a field has."""

    families: tuple[str, ...] = ()  # of its elements, as `rom.mbs.elements.family` describes them
    # {name: function on a mechanism; or a record, for the elements of that kind}
    methods: Mapping[str, str] = field(default_factory=dict)
    # {what a body has: function of it, which gives its element and its family}
    bodies: Mapping[str, str] = field(default_factory=dict)
    # {section of a mechanism file: a `rom.config.mechanism_keys.Section`}
    sections: Mapping[str, str] = field(default_factory=dict)
    # {name of a family: function of scenery, name and element, which gives what is drawn of it:
    # actors, or circles by marker, axis and radius}
    symbols: Mapping[str, str] = field(default_factory=dict)
    # {name: function on a solution, by which it tells of an element over time}
    columns: Mapping[str, str] = field(default_factory=dict)
    # {"verb.name": to what a verb of the core hands objects of the class, or files of the schema,
    # of that name: a module or a function}
    takes: Mapping[str, str] = field(default_factory=dict)
    verbs: Mapping[str, str] = field(default_factory=dict)  # {verb of the command line: its module}
    # {name: function that does a small case of all that is compiled}
    first_use: Mapping[str, str] = field(default_factory=dict)
    # {earlier name of a module, as pickles may have it: its name}
    moved: Mapping[str, str] = field(default_factory=dict)


def follow(place: str) -> Any:
    """What is at an import string."""
    module, _, name = place.partition(":")
    found = import_module(module)
    return getattr(found, name) if name else found


FAILURES: dict[str, Exception] = {}  # of records that could not be imported


@cache
def record(place: str) -> Field | None:
    """The record of a module; None if it cannot be imported, which takes no other field down."""
    try:
        found: Field = follow(place if ":" in place else f"{place}:FIELD")
    except Exception as error:
        FAILURES[place] = error
        if not is_missing(place):
            lost = _lost("", place, _told(error))
            warn(f"{lost.message} {lost.hint}")
        return None
    return found


def is_missing(place: str) -> bool:
    """Whether a record could not be imported because its field is not there at all."""
    name = getattr(FAILURES[place], "name", None) or " "
    return isinstance(FAILURES[place], ModuleNotFoundError) and f"{place}.".startswith(f"{name}.")


def _told(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".rstrip(".")


@cache
def brought() -> dict[str, str]:
    """{record: package that brings it} of the fields of other packages."""
    from importlib.metadata import entry_points

    found = entry_points(group=ENTRY_POINT_GROUP)
    return {entry.value: entry.dist.name if entry.dist else entry.name for entry in found}


def records() -> Iterator[Field]:
    """Those of all fields that are here."""
    found = (record(place) for place in (*FIELDS, *brought()))
    return (one for one in found if one is not None)


def families(*, loaded: bool = False) -> Iterator[Any]:
    """All families in the order of their tables, or only those whose modules are in use."""
    for one in records():
        for place in one.families:
            if not loaded or place.partition(":")[0] in sys.modules:
                yield follow(place)


def names(kind: str) -> dict[str, str]:
    """{name: import string} of all that fields have of one kind, an attribute of `Field`."""
    return {name: place for one in records() for name, place in getattr(one, kind).items()}


def find(kind: str, name: str) -> Any:
    """What a field has of that kind and name; None if no field has it."""
    own = [place for place, words in FIELDS.items() if name in words.split()]
    for place in own or [place for place, words in FIELDS.items() if not words] + list(brought()):
        found = record(place)
        try:
            if found is not None and name in getattr(found, kind):
                return follow(getattr(found, kind)[name])
        except Exception as error:
            raise _lost(name, place, _told(error)) from error
        if found is None and own:
            why = "is not installed" if is_missing(place) else _told(FAILURES[place])
            raise _lost(name, place, why) from FAILURES[place]
    return None


def taker(verb: str, thing: Any) -> Any:
    """To what a verb of the core hands an object, by the name of its class or of one above."""
    words = (f"{verb}.{kind.__name__}" for kind in type(thing).__mro__)
    return next(filter(None, (find("takes", word) for word in words)))


def missing(name: str, module: str, error: ModuleNotFoundError) -> Exception:
    """Why a name of a module is not there; in words if it is that of a field not installed."""
    gone = module.startswith("rom.components.") and f"{module}.".startswith(f"{error.name}.")
    return _lost(name, ".".join(module.split(".")[:3]), "is not installed") if gone else error


def _lost(name: str, place: str, why: str) -> UnknownNameError:
    module = place.partition(":")[0].removesuffix(".field")
    package = brought().get(place, "fenicsx-rom")
    why = why if why.startswith("is ") else f"cannot be imported: {why}"
    whose = f"{name!r} belongs to the field {module!r}, which" if name else f"the field {module!r}"
    return UnknownNameError(
        f"{whose} {why}.", hint=f"pip install --force-reinstall {package} brings the field whole."
    )


class Open(type):
    """Class of classes to which fields give what is asked of their objects.

    ``kind`` of what is given is an attribute of `Field`; ``bound`` is what becomes an attribute of
    the class of what a field has.
    """

    _kind: str
    _bound: Callable[[Any], Any]

    def __init__(
        cls, name: str, bases: Any, inside: Any, kind: str = "", bound: Any = None
    ) -> None:
        super().__init__(name, bases, inside)
        if kind:
            cls._kind, cls._bound = kind, bound
            cls.__dir__ = _dir  # type: ignore[assignment]

    def __new__(cls, name: str, bases: Any, inside: Any, **_: Any) -> "Open":
        """Without the keywords."""
        return super().__new__(cls, name, bases, inside)

    def bind(cls, name: str) -> bool:
        """Whether a field has it, which makes it an attribute of the class."""
        own = name.startswith("_") or name.isupper() or name in cls.__annotations__
        found = None if own else find(cls._kind, name)
        if found is not None:
            setattr(cls, name, cls._bound(found))
        return found is not None

    def __getattr__(cls, name: str) -> Any:
        if cls.bind(name):
            return getattr(cls, name)
        raise AttributeError(f"type object {cls.__name__!r} has no attribute {name!r}")

    def __dir__(cls) -> list[str]:
        """All names; what looks at a class, as ``help`` does, finds them in it from then on."""
        for name in names(cls._kind):
            with suppress(UnknownNameError):
                _ = name in vars(cls) or cls.bind(name)
        return list(super().__dir__())


def _dir(one: Any) -> list[str]:
    return sorted({*object.__dir__(one), *names(type(one)._kind)})
