"""The keys of a file as a table: validation, error messages and documentation follow from it."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Protocol

from rom.arguments import Quantity, Whole, shortened
from rom.config.document import Document, KeyPath, Values
from rom.errors import ConfigError
from rom.names import check_text
from rom.units import in_si

MOST_TOLD = 20  # mistakes in one message
LARGEST_WHOLE = 10**9  # whole number that a file may hold


@dataclass(frozen=True, slots=True)
class Place:
    """A key in a document; its mistakes are collected, so that all are told at once."""

    document: Document
    path: KeyPath = ()
    mistakes: list[ConfigError] = field(default_factory=list)

    def at(self, key: str) -> "Place":
        """A key below this one."""
        return replace(self, path=(*self.path, str(key)))

    @property
    def name(self) -> str:
        """The key with its tables, e.g. material.E."""
        return ".".join(self.path)

    def error(self, message: str, hint: str = "") -> ConfigError:
        """An error about this key, which says file and line."""
        return ConfigError(message, where=self.document.where(self.path), hint=hint)

    def note(self, message: str, hint: str = "") -> None:
        """Collect a mistake."""
        self.mistakes.append(self.error(message, hint))

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Errors from within are collected."""
        try:
            yield
        except ConfigError as error:
            self.mistakes.append(error)

    def refuse(self, value: object, wanted: str) -> NoReturn:
        """Raise the error of a value, with a sentence about what is wanted behind it."""
        raise self.error(f"{self.name} = {shortened(value)}{wanted}.")

    @contextmanager
    def told(self) -> Iterator[None]:
        """Errors from within are about this key."""
        try:
            yield
        except ConfigError as error:
            raise self.error(f"{self.name}: {error.message}", error.hint) from None


class Written(Protocol):
    """How the value of a key is written, where it is no number."""

    @property
    def summary(self) -> str:
        """In a few words, for the documentation."""

    def read(self, value: object, place: Place) -> Any:
        """The value, checked and in SI."""


def read_value(kind: "Kind", value: object, place: Place) -> Any:
    """The value of a key, checked and in SI."""
    if isinstance(kind, Quantity):
        return _quantity(kind, value, place)
    if isinstance(kind, Whole):
        return _whole(kind, value, place)
    return kind.read(value, place)


def _quantity(kind: Quantity, value: object, place: Place) -> object:
    """Number or nested lists of numbers, each a text with its unit or plain in SI."""
    found = _shape(value)
    if found is None or not kind.has_shape(found):
        place.refuse(value, f": needed is a {kind.summary}")
    numbers = _number(kind, value, place)
    if kind.ascending and kind.fault(numbers):
        place.refuse(value, f" {kind.must}")
    return numbers


def _number(kind: Quantity, value: object, place: Place) -> object:
    if isinstance(value, list):
        return [_number(kind, item, place) for item in value]
    if isinstance(value, str):
        with place.told():
            x = in_si(value, kind.unit)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        x = float(value) if abs(value) <= 1e300 else math.inf
    else:
        place.refuse(value, f" must be a {kind.summary}")
    if not kind.holds(x):
        must = kind.must if math.isfinite(x) else "must be a finite number"
        place.refuse(value, f" {must}")
    return x


def _shape(value: object) -> tuple[int, ...] | None:
    """Lengths of nested lists, None when they differ."""
    if not isinstance(value, list):
        return ()
    inner = [_shape(item) for item in value]
    first = inner[0] if inner else ()
    if first is None or any(shape != first for shape in inner):
        return None
    return (len(value), *first)


def _whole(kind: Whole, value: object, place: Place) -> int:
    if isinstance(value, int) and not isinstance(value, bool):
        if kind.holds(value) and value <= LARGEST_WHOLE:
            return value
    place.refuse(value, f" must be a {kind.summary}")


Kind = Written | Quantity | Whole


@dataclass(frozen=True, slots=True)
class Plain:
    """A value that one function reads."""

    summary: str
    read: Callable[[object, Place], Any]


def written(summary: str) -> Callable[[Callable[[object, Place], Any]], Plain]:
    """Make a kind, with words for the documentation, of the function that reads its values."""
    return partial(Plain, summary)


@dataclass(frozen=True, slots=True)
class Flag:
    """true or false, or a word that says more than true."""

    more: str = ""

    @property
    def summary(self) -> str:
        """What it may be."""
        return f'true, false or "{self.more}"' if self.more else "true or false"

    def read(self, value: object, place: Place) -> bool | str:
        """The value."""
        if isinstance(value, bool):
            return value
        if self.more and value == self.more:
            return self.more
        place.refuse(value, f" must be {self.summary}")


@dataclass(frozen=True, slots=True)
class Text:
    """A text, if need be one of some."""

    choices: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        """Text, or the choices."""
        return ", ".join(f'"{c}"' for c in self.choices) or "text"

    def read(self, value: object, place: Place) -> str:
        """The text."""
        if not isinstance(value, str) or not value or "\0" in value:
            place.refuse(value, " must be a text")
        if self.choices and value not in self.choices:
            hint = nearest(value, self.choices)
            raise place.error(f"{place.name} = {value!r} does not exist.", hint)
        return value


@written("text, or list of texts")
def words(value: object, place: Place) -> tuple[str, ...]:
    """A text or a list of texts."""
    values = value if isinstance(value, list) else [value]
    return tuple(Text().read(item, place) for item in values)


@written("file")
def file_path(value: object, place: Place) -> Path:
    """A file, relative to the folder of the document."""
    return place.document.path.parent / Text().read(value, place)


@written("file")
def output_path(value: object, place: Place) -> Path:
    """A file that is written, in the folder of the document or one below it."""
    path, folder = Path(file_path.read(value, place)), place.document.path.parent
    if not path.resolve().is_relative_to(folder.resolve()):
        outside = f" leads out of the folder of its file, {folder.resolve()}"
        place.refuse(value, f"{outside}; -o on the command line may name any place")
    return path


@written("number or text")
def anything(value: object, place: Place) -> object:
    """Left to whoever uses it."""
    if isinstance(value, int | float | str | list | dict):
        return value
    place.refuse(value, " must be a number or text")


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a table."""

    name: str
    kind: Kind
    about: str  # one sentence
    default: object = None  # ... where a value must be given, {} for a table of defaults


@dataclass(frozen=True, slots=True)
class Table:
    """The keys a table may hold."""

    about: str  # one sentence
    keys: tuple[Key, ...]
    summary: ClassVar[str] = "table"

    def read(self, value: object, place: Place) -> Values:
        """Values by key: those given, and defaults that are values."""
        if not isinstance(value, Mapping):
            place.refuse(value, f": needed is a table [{place.name}]")
        known = [key.name for key in self.keys]
        inside = f" in [{place.name}]" if place.path else ""
        for name in value:
            if name not in known:
                place.at(name).note(f"there is no key {name!r}{inside}.", nearest(name, known))
        found: Values = {}
        for key in self.keys:
            if key.name in value or key.default == {}:  # a table of its own defaults
                given = value.get(key.name, {})
                with place.noted():
                    found[key.name] = read_value(key.kind, given, place.at(key.name))
            elif key.default is ...:
                hint = f"{key.about[:-1]}: {key.kind.summary}."
                place.note(f"{key.name} is missing{inside}.", hint)
            elif key.default is not None:
                found[key.name] = key.default
        return found


@dataclass(frozen=True, slots=True)
class Named:
    """A table of things by name."""

    kind: Kind
    what: str

    @property
    def summary(self) -> str:
        """Called a table by name."""
        return f"table of {self.what} by name"

    def read(self, value: object, place: Place) -> Values:
        """Values by name."""
        if not isinstance(value, Mapping):
            place.refuse(value, f": needed is a {self.summary}")
        found: Values = {}
        for name, item in value.items():
            with place.noted():
                with place.told():
                    check_text(name, self.what)
                found[name] = read_value(self.kind, item, place.at(name))
        return found


@dataclass(frozen=True, slots=True)
class Variants:
    """Tables told apart by their key ``kind``, or by one that only some of them have."""

    tables: Mapping[str, Table]
    # {key: kind it stands for where none is written}
    telling: Mapping[str, str] = field(default_factory=dict)
    usual: str = ""  # kind where no key tells; then no kind is ever written

    @property
    def summary(self) -> str:
        """The kinds."""
        words = "table of" if self.usual else "table with a kind:"
        return f"{words} {', '.join(self.tables)}"

    def read(self, value: object, place: Place) -> Values:
        """Values by key, ``kind`` among them."""
        if not isinstance(value, Mapping):
            place.refuse(value, f": needed is a table [{place.name}]")
        written = [kind for key, kind in self.telling.items() if key in value]
        if self.usual:
            return self.tables[(*written, self.usual)[0]].read(value, place)
        if "kind" not in value and not written:
            raise place.error(f"kind is missing in [{place.name}].", nearest("", self.tables))
        named = value.get("kind", written[0] if written else "")
        kind = Text(tuple(self.tables)).read(named, place.at("kind"))
        remaining = {key: item for key, item in value.items() if key != "kind"}
        return {"kind": kind} | self.tables[kind].read(remaining, place)


@dataclass(frozen=True, slots=True)
class Either:
    """A table, or something shorter that stands for it."""

    short: Kind
    table: Kind

    @property
    def summary(self) -> str:
        """Both forms."""
        return f"{self.short.summary}; or {self.table.summary}"

    def read(self, value: object, place: Place) -> object:
        """Either form."""
        return read_value(self.table if isinstance(value, Mapping) else self.short, value, place)


def nearest(word: str, known: Iterable[object]) -> str:
    """The nearest known word, and the list of them."""
    words = [str(k) for k in known]
    near = get_close_matches(word, words, n=1)
    return (f"Did you mean {near[0]}? " if near else "") + f"Known: {', '.join(words)}."


def read_table(table: Table, document: Document) -> Values:
    """The values of a document."""
    place = Place(document)
    values = table.read(document.data, place)
    raise_mistakes(place)
    return values


def raise_mistakes(place: Place) -> None:
    """Raise what has been collected, the first mistake in front."""
    found = place.mistakes
    if len(found) == 1:
        raise found[0]
    if found:
        count, found = len(found), found[:MOST_TOLD]
        file = str(place.document.path)
        numbered = ((int("0" + e.where.removeprefix(file).strip(":")), e) for e in found)
        by_line = sorted(numbered, key=itemgetter(0))
        messages = [f"line {line}: {e.message}" if line else e.message for line, e in by_line]
        more = f" And {count - len(found)} more." if count > len(found) else ""
        text, first = f"{count} mistakes. {' '.join(messages)}{more}", by_line[0][1]
        raise ConfigError(text, where=first.where, hint=first.hint)
