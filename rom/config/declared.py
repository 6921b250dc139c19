"""Tables of keys as functions and records declare them: by annotation, default and docstring.

Keys are the arguments that a method takes by keyword alone, and all arguments of a record.
"""

import re
import typing
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from functools import cached_property
from inspect import Parameter, getdoc
from pathlib import Path
from types import MappingProxyType, UnionType
from typing import Any, Literal

from rom.arguments import Quantity, Whole
from rom.arguments.kinds import parameters_of
from rom.config.keys import Flag, Key, Kind, Named, Table, Text, file_path, words
from rom.fields import follow

SHAPE_OR_UNIT = re.compile(r"^\([\dnr, ]+\)( or \([\d, ]+\))? | ?\[(?!degrees)[^]]*\]")
NO_VALUE = re.compile("; None( for|:)")
PLAIN_KINDS: dict[object, Kind] = {float: Quantity(), int: Whole(), bool: Flag(), str: Text()}
PLAIN_KINDS[Path] = file_path


class Declared(Table):
    """The keys of a table as functions and records have them, which are imported when it is used.

    Places, with blanks, are methods of a mechanism and import strings "module:name" of functions
    and records; keys stand in front of theirs, or in place of those of the same name. Without are
    arguments that are no keys; defaults and kinds differ from those of signature and annotation.
    """

    places: list[str]
    own: dict[str, Key]
    without: list[str]
    defaults: Mapping[str, object]
    kinds: Mapping[str, Kind]

    def __init__(
        self,
        places: str,
        *keys: Key,
        about: str = "",
        without: str = "",
        defaults: Mapping[str, object] = MappingProxyType({}),
        **kinds: Kind,
    ) -> None:
        own = {key.name: key for key in keys}
        stated = {"about": about} if about else {}
        given = {"own": own, "defaults": defaults, "kinds": kinds, **stated}
        self.__dict__.update(places=places.split(), without=without.split(), **given)

    @cached_property
    def about(self) -> str:
        """One sentence."""
        return _first_sentence(_first_paragraph(_made(self.places[0])))

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """Own ones in front, and those in place of others where these would be."""
        found = {
            key.name: self.own.get(key.name, key)
            for place in self.places
            for key in _keys_of(_made(place), self.kinds, self.defaults)
            if key.name not in self.without
        }
        front = {name: key for name, key in self.own.items() if name not in found}
        return tuple((front | found).values())


def _made(place: str) -> Any:
    if ":" in place:
        return follow(place)
    from rom.mbs.mechanism import Mechanism

    return getattr(Mechanism, place)


def _keys_of(made: Any, kinds: Mapping[str, Kind], defaults: Mapping[str, object]) -> list[Key]:
    """The keys of a function, or of all fields of a record."""
    sentences = _sentences(getdoc(made) or "")
    found = []
    for one in parameters_of(made):
        default = ... if one.default is Parameter.empty else one.default
        kind = kinds.get(one.name) or _kind(one.annotation)
        named = one.kind is Parameter.KEYWORD_ONLY or isinstance(kind, Quantity)
        if kind is not None and (named or is_dataclass(made)):
            about = sentences.get(one.name) or f"{one.name.replace('_', ' ').capitalize()}."
            found.append(Key(one.name, kind, about, defaults.get(one.name, default)))
    return found


def _kind(annotation: object) -> Kind | None:
    """How a value of an annotation is written; None if it is written in no way."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        return inner[1] if isinstance(inner[1], Quantity | Whole) else _kind(inner[0])
    if origin in (typing.Union, UnionType):
        kinds = (_kind(one) for one in inner)
        return next((kind for kind in kinds if kind is not None), None)
    if origin is Literal:
        return Text(inner)
    if origin in (dict, Mapping) and (kind := _kind(inner[1])) is not None:
        return Named(kind, "values")
    if origin in (tuple, list, Sequence) and inner[0] is str:
        return words
    if origin is tuple and isinstance(kind := _kind(inner[0]), Quantity):
        return replace(kind, shapes=((None if inner[-1] is ... else len(inner),),))
    if is_dataclass(annotation):
        return Table(_first_paragraph(annotation), tuple(_keys_of(annotation, {}, {})))
    return PLAIN_KINDS.get(annotation)


def _first_paragraph(made: object) -> str:
    return (getdoc(made) or "").partition("\n\n")[0]


def _sentences(docstring: str) -> dict[str, str]:
    """The first sentence about each argument of a docstring."""
    section = re.search(r"^(?:Args|Attributes):\n((?:    .*\n?|\n)+)", docstring, re.MULTILINE)
    entries = re.split(r"^    (?=\S)", section[1] if section else "", flags=re.MULTILINE)
    found: dict[str, str] = {}
    for entry in entries:
        names, _, text = entry.partition(":")
        found |= dict.fromkeys(names.split(", "), _first_sentence(text))
    return found


def _first_sentence(text: str) -> str:
    """Without shape and unit, which its kind says."""
    text = NO_VALUE.sub("; if missing,", " ".join(text.split()))
    sentence = re.split(r"(?<=\w\w)\. ", SHAPE_OR_UNIT.sub("", text).strip())[0].rstrip(".")
    return f"{sentence[0].upper()}{sentence[1:]}." if sentence else ""
