"""What an annotation takes: the words for it, and the value as the function gets it."""

import builtins
import collections.abc
import math
import operator
import os
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from inspect import Parameter, signature
from numbers import Integral, Real
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from rom.arguments.quantities import Quantity, Whole
from rom.arguments.values import shortened
from rom.errors import ConfigError, RomError

MAX_NUMBER = 1e150  # the square of it is still a finite number
LARGEST_WHOLE = 2**63 - 1  # that compiled code can count to
KINDS_OF_NUMBERS = {  # scalar type of an array -> kinds of types that may stand for it
    np.bool_: "b",
    np.int64: "iu",
    np.integer: "iu",
    np.float64: "iuf",
    np.complex128: "iufc",
}
SOURCES = {  # class -> where its objects come from, for people who have something else in hand
    "FEModel": "from rom.fe.model or rom.read_model",
    "FlexibleBody": "from rom.reduce or rom.load",
    "BodyFamily": "from rom.reduce_parametric or rom.load",
    "Method": "such as rom.CraigBampton(n_modes=20)",
    "CyclicSector": "from rom.CyclicSector.from_model",
    "SubstructuredSector": "from rom.substructured_sector",
    "ReducedBlade": "from rom.reduced_blade",
    "Mechanism": "from rom.Mechanism or rom.read_mechanism",
    "Part": "from Mechanism.add_rigid or add_flexible",
    "Marker": "from part.marker(place), named when the part is added",
    "State": "from rom.equilibrium or solution.final",
    "Solution": "from rom.simulate",
}
EXAMPLE_VALUES = {"n_modes": 20, "order": 3}  # of arguments, in what a message proposes to write
ARRAY_LIKE = frozenset(typing.get_args(npt.ArrayLike))  # none from NumPy 2.5 on: a kind by itself


@dataclass(eq=False)
class Unfit(Exception):
    """A value is not what is wanted, in words; or its part at a place, such as ``['a']``.

    A sentence is said of it behind its name where that is more than what is wanted.
    """

    value: Any
    wanted: str
    place: str = ""
    sentence: str = ""
    error: type[RomError] = ConfigError

    def within(self, place: str) -> "Unfit":
        """The same of something that has this value at a place."""
        return replace(self, place=place + self.place)


@dataclass(frozen=True, slots=True)
class Taken:
    """What a function takes for one argument."""

    words: str
    take: Callable[[Any], Any]  # gives what the function gets, or raises

    def __call__(self, value: Any) -> Any:
        """The value as the function gets it."""
        try:
            return self.take(value)
        except (TypeError, ValueError, OverflowError, AttributeError) as error:
            raise Unfit(value, self.words) from error


class Names(dict[str, Any]):
    """Names in the annotations of a module; unknown ones are classes known by name only."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, None) or _Named(name, (), {})


class _Named(type):
    """A class that is not imported here."""

    def __instancecheck__(cls, value: Any) -> bool:
        return any(kind.__name__ == cls.__name__ for kind in type(value).__mro__)


# records that the layers do not let every module import
AnyBody = Annotated[Any, _Named("FlexibleBody", (), {})]
AnyFamily = Annotated[Any, _Named("BodyFamily", (), {})]
AnyMechanism = Annotated[Any, _Named("Mechanism", (), {})]
AnySector = Annotated[Any, _Named("CyclicSector", (), {})]
AnySolution = Annotated[Any, _Named("Solution", (), {})]


def evaluated(annotation: Any, known: Names) -> Any:
    """What an annotation stands for that is written as text."""
    if isinstance(annotation, str):
        return eval(annotation, {}, known)  # our own source, as Python would
    return annotation


def taken_by(annotation: Any, known: Names) -> Taken | None:
    """What an annotation takes; None for anything."""
    annotation = evaluated(annotation, known)
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation in PLAIN_KINDS:
        return PLAIN_KINDS[annotation]
    if origin is Annotated:
        return _annotated(inner[0], inner[1], known)
    if origin in (typing.Union, types.UnionType):
        return _one_of([taken_by(kind, known) for kind in _alternatives(inner)])
    if origin is typing.Literal:
        return _word_of(inner)
    if origin is np.ndarray:
        return _array(*typing.get_args(inner[1]))
    if origin is tuple and inner[-1] is not ...:
        return _row([taken_by(kind, known) for kind in inner])
    if origin in (tuple, list, collections.abc.Sequence):
        return _several(taken_by(inner[0], known), list if origin is list else tuple)
    if origin in (dict, Mapping):
        return _mapping(*(taken_by(kind, known) for kind in inner))
    if origin is collections.abc.Callable:
        return ANY_FUNCTION
    return _instance(annotation) if isinstance(annotation, type) else None


def _annotated(kind: Any, more: Any, known: Names) -> Taken:
    """A class by its name; or what a kind takes, in other words or within limits."""
    if isinstance(more, type):
        return _instance(more)
    taken = taken_by(kind, known)
    return _limited(more, taken) if isinstance(more, Quantity | Whole) else _in_words(more, taken)


def _alternatives(kinds: Iterable[Any]) -> list[Any]:
    """Members of a union; those that make up an array-like or a path stand for one thing."""
    found = list(kinds)
    if ARRAY_LIKE and ARRAY_LIKE.issubset(found):
        found = [*(kind for kind in found if kind not in ARRAY_LIKE), npt.ArrayLike]
    if Path in found:
        found.remove(str)
    return found


def _in_words(words: str, taken: Taken | None) -> Taken:
    def take(value: Any) -> Any:
        try:
            return value if taken is None else taken(value)
        except Unfit as unfit:
            deep = unfit.place or unfit.sentence
            raise (unfit if deep else Unfit(value, words)) from unfit.__cause__

    return Taken(words, take)


def _limited(kind: Quantity | Whole, taken: Taken | None) -> Taken:
    """Numbers of a shape and within limits; one that has a unit is a float."""
    one = taken or ANY_VALUE
    words = kind.words if isinstance(kind, Whole) else one.words

    def take(value: Any) -> Any:
        found = one.take(value)
        if fault := kind.fault(found):
            raise Unfit(value, words, sentence=fault, error=kind.error)
        return float(found) if one is PLAIN_KINDS[float] else found

    return Taken(words, take)


def _one_of(several: list[Taken | None]) -> Taken | None:
    takes = [take for take in several if take is not None and take is not NONE_ONLY]
    if None in several:
        return None
    words = _either([take.words for take in takes] + ["None"] * (NONE_ONLY in several))

    def take(value: Any) -> Any:
        if value is None and NONE_ONLY in several:
            return None
        deepest = Unfit(value, words)
        for one in takes:
            try:
                return one(value)
            except Unfit as unfit:
                deepest = max(deepest, unfit, key=lambda x: (len(x.place), bool(x.sentence)))
        raise deepest

    return Taken(words, take)


def _either(words: list[str]) -> str:
    return " or ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def _word_of(known: tuple[Any, ...]) -> Taken:
    def take(value: Any) -> Any:
        if np.ndim(value):  # which NumPy would compare entry by entry
            raise TypeError(value)
        return known[known.index(value)]

    return Taken(_either(list(map(repr, known))), take)


def _instance(kind: type) -> Taken:
    verbs = _verbs(kind)

    def take(value: Any) -> Any:
        if isinstance(value, type) and not issubclass(kind, type):
            raise TypeError(value)  # it may have the verbs, but not the values
        fits = (hasattr(type(value), verb) or hasattr(value, verb) for verb in verbs)
        if not (all(fits) if verbs else isinstance(value, kind)):
            raise TypeError(kind)
        return value

    source = SOURCES.get(kind.__name__)
    return Taken(f"of type {kind.__name__}" + (f" ({source})" if source else ""), take)


def call_of(kind: type) -> str:
    """What to write where a class was given in place of one of its objects."""
    names = [p.name for p in signature(kind).parameters.values() if p.default is Parameter.empty]
    own = names or list(signature(kind).parameters)[:1]
    given = ", ".join(f"{name}={EXAMPLE_VALUES.get(name, '...')}" for name in own)
    return f"{kind.__name__} is a class; write {kind.__name__}({given})."


def _verbs(kind: type) -> set[str]:
    """What a protocol asks for; nothing for another class."""
    if not getattr(kind, "_is_protocol", False):
        return set()
    names = {*vars(kind), *vars(kind).get("__annotations__", ())}
    return {name for name in names if name == "__call__" or not name.startswith("_")}


def _several(one: Taken | None, kind: type) -> Taken:
    what = "" if one is None else f", each {one.words}"

    def take(value: Any) -> Any:
        if isinstance(value, str) and one is ANY_TEXT:
            return kind([value])
        if isinstance(value, str | bytes | Mapping):
            raise TypeError(value)
        return kind(value if one is None else _each(one, enumerate(value)))

    return Taken("names" if one is ANY_TEXT else f"a sequence{what}", take)


def _row(takes: list[Taken | None]) -> Taken:
    each = [ANY_VALUE if take is None else take for take in takes]

    def take(value: Any) -> Any:
        if isinstance(value, str | bytes | Mapping) or len(value) != len(each):
            raise TypeError(value)
        pairs = zip(each, enumerate(value), strict=True)
        return tuple(x for one, item in pairs for x in _each(one, [item]))

    return Taken(f"a row of {len(each)} ({', '.join(one.words for one in each)})", take)


def _each(one: Taken, items: Iterable[tuple[Any, Any]]) -> Iterator[Any]:
    for key, x in items:
        try:
            yield one(x)
        except Unfit as unfit:
            raise unfit.within(f"[{shortened(key)}]") from unfit.__cause__


def _mapping(key: Taken | None, one: Taken | None) -> Taken:
    words = "a dictionary" + (f" whose values are {one.words}" if one else "")

    def take(value: Any) -> Any:
        if not isinstance(value, Mapping):
            raise TypeError(value)
        for name in value:
            (key or ANY_VALUE)(name)
        # one that makes its values when they are asked for may take long: they are not asked for
        if one is None or not isinstance(value, dict | types.MappingProxyType):
            return value
        return dict(zip(value, _each(one, value.items()), strict=True))

    return Taken(words, take)


def _array(scalar: Any) -> Taken | None:
    """An array that was computed; whoever uses it judges its entries."""
    scalar = typing.get_origin(scalar) or scalar
    if scalar not in KINDS_OF_NUMBERS:
        return None
    kinds = KINDS_OF_NUMBERS[scalar]

    def take(value: Any) -> Any:
        found = _numbers(value, kinds)
        return value if isinstance(value, np.ndarray) else found.astype(scalar)

    words = {"iu": "an array of whole numbers", "b": "an array of True and False"}
    return Taken(words.get(kinds, "an array of numbers"), take)


def _array_like(value: Any) -> Any:
    found = _numbers(value, "iuf")
    for entry in (found.min(), found.max()) if found.size else ():
        _number(entry)
    return value


def _numbers(value: Any, kinds: str) -> npt.NDArray[Any]:
    given = isinstance(value, np.ndarray)
    if not given:  # refuses rows of unequal length, of which NumPy would make objects
        np.array(value, dtype=complex)
    array = np.asarray(value)
    if array.dtype.kind not in kinds and (given or array.size):
        raise TypeError(array.dtype)
    return array


def _number(value: Any) -> Any:
    if type(value) is not float:
        if isinstance(value, np.ndarray) and not value.shape and value.dtype.kind in "iuf":
            value = value[()]
        if isinstance(value, bool) or not isinstance(value, Real):
            raise TypeError(value)
    if not math.isfinite(value):
        raise ValueError(value)
    if abs(value) > MAX_NUMBER:
        raise Unfit(value, f"a number of at most {MAX_NUMBER:g}")
    return value


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise TypeError(value)
    whole = operator.index(value)
    if abs(whole) > LARGEST_WHOLE:
        raise ValueError(value)
    return whole


def _truth(value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise TypeError(value)
    return bool(value)


def _path(value: Any) -> Any:
    text = os.fspath(value)
    if not isinstance(text, str) or "\0" in text:
        raise TypeError(value)
    return value


def _such(fits: Callable[[Any], bool]) -> Callable[[Any], Any]:
    """Takes what fits as it is."""

    def take(value: Any) -> Any:
        if not fits(value):
            raise TypeError(value)
        return value

    return take


def _text(value: Any) -> str:
    if not isinstance(value, str):
        name = getattr(value, "name", None)
        raise Unfit(value, "a text" + (f": write {name!r}" if isinstance(name, str) else ""))
    return value


ANY_VALUE = Taken("anything", lambda value: value)
NONE_ONLY = Taken("None", _such(lambda value: value is None))
ANY_TEXT = Taken("a text", _text)
ANY_FUNCTION = Taken("a function", _such(callable))
PLAIN_KINDS: dict[Any, Taken | None] = {
    float: Taken("a finite number", _number),
    int: Taken("a whole number", _whole),
    bool: Taken("True or False", _truth),
    str: ANY_TEXT,
    Path: Taken("a path", _path),
    npt.ArrayLike: Taken("finite numbers", _array_like),
    type(None): NONE_ONLY,
    None: NONE_ONLY,
    object: None,
    Any: None,
    Parameter.empty: None,
    Callable: ANY_FUNCTION,
}
