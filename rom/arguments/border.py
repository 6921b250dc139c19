"""One check for the types of all arguments of public functions: what their annotations say.

Python finds out that an argument is of the wrong type where it is first used, deep inside, in words
about attributes and subscripts. The border is the public function, and there the user is told.
"""

import re
import types
from collections.abc import Callable
from dataclasses import fields
from difflib import get_close_matches
from functools import wraps
from inspect import Parameter
from typing import Any, TypeVar

import numpy as np

from rom.arguments.kinds import Taken, Unfit, call_of, parameters_of, taken_by
from rom.arguments.values import is_number, shortened
from rom.errors import ConfigError, RomError, UnknownNameError
from rom.names import offered
from rom.plausible import USUAL, warn_outside

Public = TypeVar("Public", bound=Callable[..., object])
Record = TypeVar("Record")
Given = tuple[object, ...]  # arguments by place
Named = dict[str, object]  # and by name
LONGEST_SHOWN = 200  # letters of a value in a record
MAX_NEAR = 6  # names that are offered for an unknown one
OF_STATES = "Ask rom.snapshot(mechanism, state), which has what motions have."
NAMES_ELSEWHERE = {  # class: {name that its objects do not have: what to write instead}
    "State": dict.fromkeys(("position", "velocity", "reaction", "elastic", "axes"), OF_STATES),
    "FEModel": {"frequencies": "Write rom.modes(model, 12).frequencies."},
    "Mechanism": {"add_body": "Write add_rigid, or add_flexible with a body of rom.reduce."},
}
BY_PLACE = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)


def typed(public: Public) -> Public:
    """Check the arguments of a public function, or of all public methods of a class, at each call.

    Methods that a class inherits are checked where it shows them, not in the class they are from.
    Booleans are no numbers, numbers are finite, whole numbers fit eight bytes, paths are no
    numbers and no bytes. What stands for the same thing becomes it: scalars of NumPy, one name
    where names are wanted, any iterable for a tuple, lists for arrays. Missing and unknown
    arguments remain a TypeError of Python; a record that says in ``TAKEN_BY`` who takes it is
    refused by all others in these words.

    Annotations are read at the first call. A class that is imported for type checks alone is known
    by its name: an object of it cannot exist unless somebody else has imported it.
    """
    if not isinstance(public, type):
        return _typed_function(public)  # type: ignore[return-value]
    if "__getattr__" not in vars(public):
        public.__getattr__ = _unknown  # type: ignore[attr-defined]
    if hasattr(vars(public).get("__repr__"), "__wrapped__"):  # made by dataclass
        public.__repr__ = _shown  # type: ignore[assignment]
    members = {name: member for base in public.__mro__[::-1] for name, member in vars(base).items()}
    for name, member in members.items():
        if name.startswith("_") and (name != "__init__" or name not in vars(public)):
            continue
        if name not in vars(public) and hasattr(member, "__wrapped__"):  # checked already
            continue
        if isinstance(member, types.FunctionType):
            setattr(public, name, _typed_function(member))
        elif isinstance(member, classmethod | staticmethod):
            setattr(public, name, type(member)(_typed_function(member.__func__)))
    return public


def typed_record(record: type[Record]) -> type[Record]:
    """Check the arguments of a constructor alone, of a record whose methods are asked in loops."""
    setattr(record, "__init__", _typed_function(record.__init__))  # noqa: B010  not of one type
    return record


def _unknown(record: object, name: str) -> object:
    """What a field gives, see `rom.fields`; else raise what Python would, with the names near."""
    bind = getattr(type(type(record)), "bind", None)
    if bind and bind(type(record), name):
        return getattr(record, name)
    kind = type(record).__name__
    text = f"{kind!r} object has no attribute {name!r}"
    if name.startswith("_"):
        raise AttributeError(text, name=name, obj=record)
    public = [known for known in dir(record) if not known.startswith("_")]
    near = f"Near are {get_close_matches(name, public, MAX_NEAR, cutoff=0.0)}."
    hint = NAMES_ELSEWHERE.get(kind, {}).get(name, near)
    raise UnknownNameError(f"{text}.", hint=hint)


def _shown(record: Any) -> str:
    """A record in one line: arrays by their sizes, anything else as it is if that is short."""
    values = {one.name: getattr(record, one.name) for one in fields(record) if one.repr}
    words = (f"{name}={_shown_value(value)}" for name, value in values.items())
    return f"{type(record).__qualname__}({', '.join(words)})"


def _shown_value(value: object) -> str:
    if isinstance(value, np.ndarray) and value.size > 1:
        return f"[{' x '.join(map(str, value.shape))}]"
    return text if len(text := repr(value)) <= LONGEST_SHOWN else shortened(value)


def _typed_function(function: Callable[..., object]) -> Callable[..., object]:
    border: list[_Border] = []

    @wraps(function)
    def at_border(*args: object, **named: object) -> object:
        if not border:
            border.append(_Border(function))
        try:
            taken, named = border[0].passed(args, named)
        except RomError as error:  # the traceback ends where the user made the call
            raise error.with_traceback(None) from None
        return function(*taken, **named)

    return at_border


class _Border:
    """What a function takes, by place and by name."""

    def __init__(self, function: Callable[..., object]):
        self.name = function.__name__
        parameters = parameters_of(function)
        # a function beside the class can be a method of it too
        named = [p.name for p in parameters]
        self.method = "." in function.__qualname__ or named[:1] == ["self"]
        takes = {p.name: taken_by(p.annotation) for p in parameters}
        self.more = [takes.pop(p.name) for p in parameters if p.kind is p.VAR_KEYWORD]
        rest = [(p.name, takes[p.name]) for p in parameters if p.kind is p.VAR_POSITIONAL]
        self.rest = rest or [("", None)]  # more than Python will let through
        self.places = [(p.name, takes[p.name]) for p in parameters if p.kind in BY_PLACE]
        self.takes = takes
        # where a text is nothing else
        texts = {p.name: str(p.annotation) for p in parameters if "Marker" in str(p.annotation)}
        self.markers = {name for name, text in texts.items() if not re.search(r"\bstr\b", text)}
        owner = function.__qualname__.removesuffix(".__init__").split(".")[-1]
        ranges = ((p, USUAL.get(f"{owner}.{p}", USUAL.get(p))) for p in takes)
        self.usual = {p: limits for p, limits in ranges if limits}

    def passed(self, args: Given, named: Named) -> tuple[list[object], Named]:
        unknown = [] if self.more else [name for name in named if name not in self.takes]
        for name in unknown:
            if owners := getattr(type(named[name]), "TAKEN_BY", None):
                text = f"{name} = {shortened(named[name])} is for {owners} alone."
                raise ConfigError(text, where=self._label(args, named), hint=f"Leave {name} out.")
        if self.markers and args:
            args, named = self._with_markers(args, named)
        given = zip(self._places(len(args)), args, strict=True)
        try:
            taken = [_taken(name, take, value) for (name, take), value in given]
            more = {k: _taken(k, self.takes.get(k, *self.more), x) for k, x in named.items()}
        except Unfit as unfit:
            where, hint = self._label(args, named), f"must be {unfit.wanted}."
            text = f"{unfit.place} = {shortened(unfit.value)} {hint}"
            if unfit.sentence:
                text, hint = unfit.place + unfit.sentence, ""
            if isinstance(unfit.value, type):
                text, hint = f"{unfit.place}: {call_of(unfit.value)}", ""
            raise unfit.error(text, where=where, hint=hint) from None
        if unknown:
            free = [known for known in self.takes if known not in named and known != "self"]
            text = f"{self._label(args[:1], {})}() got an unexpected keyword argument"
            raise TypeError(f"{text} {unknown[0]!r}; there are {offered(free, unknown[0])}")
        if self.usual:
            self._doubt(taken, more)
        return taken, more

    def _with_markers(self, args: Given, named: Named) -> tuple[Given, Named]:
        """Markers in place of their names, as what the first argument is of has them."""
        owners = (_held(args[0], name) for name in ("mechanism", "packed"))
        find = _held(next((one for one in owners if one is not None), args[0]), "marker")

        def found(name: str, value: object) -> object:
            if name in self.markers and isinstance(value, list | tuple):
                return [found(name, x) for x in value]
            if find is None or name not in self.markers or not isinstance(value, str):
                return value
            try:
                return find(value)
            except ConfigError as error:
                error.message = f"{name} = {value!r}: {error.message}"
                error.where = self._label(args, named)
                raise

        places = zip(self._places(len(args)), args, strict=True)
        by_place = tuple(found(name, value) for (name, _), value in places)
        return by_place, {name: found(name, value) for name, value in named.items()}

    def _doubt(self, taken: list[object], named: Named) -> None:
        """Warn of numbers that no machine has, as those in another unit are."""
        given = dict(zip((name for name, _ in self.places), taken, strict=False)) | named
        for name, limits in self.usual.items():
            value = given.get(name, 0.0)
            if is_number(value) and value:
                warn_outside(limits, value, self._label(tuple(taken), named))

    def _places(self, n: int) -> list[tuple[str, Taken | None]]:
        beyond = n - len(self.places)
        return self.places[:n] if beyond <= 0 else self.places + self.rest * beyond

    def _label(self, args: Given, named: Named) -> str:
        """The function and, where it makes something that has a name, that name."""
        by_place = dict(zip((name for name, _ in self.places), args, strict=False))
        made = (by_place | named).get("name")
        about = f" {shortened(made)}" if isinstance(made, str) else ""
        if not self.method or not args:
            return self.name + about
        owner = args[0].__name__ if isinstance(args[0], type) else type(args[0]).__name__
        return (owner if self.name == "__init__" else f"{owner}.{self.name}") + about


def _held(thing: object, name: str) -> Any:
    """An attribute, or None; no field is asked for it."""
    try:
        return object.__getattribute__(thing, name)
    except AttributeError:
        return None


def _taken(name: str, take: Taken | None, value: object) -> object:
    if take is None:
        return value
    try:
        return take(value)
    except Unfit as unfit:
        raise unfit.within(name) from unfit.__cause__
