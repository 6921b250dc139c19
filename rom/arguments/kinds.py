"""What an annotation takes: the words for it, and the value as the function gets it."""

import builtins
import collections.abc
import math
import operator
import os
import sys
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from dataclasses import dataclass, replace
from inspect import Parameter, signature
from numbers import Integral, Real
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from rom.arguments.quantities import Quantity, Whole
from rom.arguments.values import is_endless, plain, shortened
from rom.errors import ConfigError, RomError

MAX_NUMBER = 1e150  # the square of it is still a finite number
LARGEST_WHOLE = 2**63 - 1  # that compiled code can count to
KINDS_OF_NUMBERS: dict[Any, str] = {  # scalar type of an array -> kinds that may stand for it
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
Take = Callable[[Any], Any]  # gives what the function gets, or raises
ARRAY_LIKE = frozenset(typing.get_args(npt.ArrayLike))  # none from NumPy 2.5 on: a kind by itself


@dataclass(eq=False)
class Unfit(Exception):
    """A value, or its part at a place such as ``['a']``, is not what is wanted."""

    value: object
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
    take: Take

    def __call__(self, value: object) -> object:
        """The value as the function gets it."""
        try:
            return self.take(value)
        except (TypeError, ValueError, OverflowError, AttributeError) as error:
            raise Unfit(value, self.words) from error


class _Names(dict[str, object]):
    """Names in the annotations of a module; unknown ones are classes known by name only."""

    def __missing__(self, name: str) -> object:
        return getattr(builtins, name, None) or _Named(name, (), {})


class _Named(type):
    """A class that is not imported here."""

    def __instancecheck__(cls, value: object) -> bool:
        return any(kind.__name__ == cls.__name__ for kind in type(value).__mro__)


def parameters_of(function: Callable[..., object]) -> list[Parameter]:
    """Its parameters, with annotations that are written as text read as Python would."""
    names = _Names(vars(sys.modules[function.__module__]))
    return list(signature(function, locals=names, eval_str=True).parameters.values())


# records that the layers do not let every module import
AnyBody = Annotated[Any, _Named("FlexibleBody", (), {})]
AnyFamily = Annotated[Any, _Named("BodyFamily", (), {})]
AnyMechanism = Annotated[Any, _Named("Mechanism", (), {})]
AnySector = Annotated[Any, _Named("CyclicSector", (), {})]
AnySolution = Annotated[Any, _Named("Solution", (), {})]


def taken_by(annotation: object) -> Taken | None:
    """What an annotation takes; None for anything."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation in PLAIN_KINDS:
        return PLAIN_KINDS[annotation]
    if origin is Annotated:
        return _annotated(inner[0], inner[1])
    if origin in (typing.Union, types.UnionType):
        return _one_of([taken_by(kind) for kind in _alternatives(inner)])
    if origin is typing.Literal:
        return _word_of(inner)
    if origin is np.ndarray:
        return _array(*typing.get_args(inner[1]))
    if origin is tuple and inner[-1] is not ...:
        return _row([taken_by(kind) for kind in inner])
    if origin in (tuple, list, collections.abc.Sequence):
        return _several(taken_by(inner[0]), list if origin is list else tuple)
    if origin in (dict, Mapping):
        return _mapping(*map(taken_by, inner))
    if origin is collections.abc.Callable:
        return ANY_FUNCTION
    if isinstance(annotation, str):  # within another one
        annotation = _Named(annotation, (), {})
    return _instance(annotation) if isinstance(annotation, type) else None


def _annotated(kind: object, more: object) -> Taken | None:
    """A class by its name; or what a kind takes, in other words or within limits."""
    if isinstance(more, type):
        return _instance(more)
    taken = taken_by(kind)
    if isinstance(more, Quantity | Whole):
        return _limited(more, taken)
    return _in_words(more, taken) if isinstance(more, str) else taken


def _alternatives(kinds: Iterable[object]) -> list[object]:
    """Members of a union; those that make up an array-like or a path stand for one thing."""
    found = list(kinds)
    if ARRAY_LIKE and ARRAY_LIKE.issubset(found):
        found = [*(kind for kind in found if kind not in ARRAY_LIKE), npt.ArrayLike]
    if Path in found:
        found.remove(str)
    return found


def _in_words(words: str, taken: Taken | None) -> Taken:
    def take(value: object) -> object:
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
    infinite = isinstance(kind, Quantity) and kind.infinite

    def take(value: object) -> object:
        number = _in_si(value, kind.unit) if isinstance(kind, Quantity) else value
        found: Any = number if infinite and is_endless(value) else one.take(number)
        if fault := kind.fault(found):
            raise Unfit(value, words, sentence=fault, error=kind.error)
        return float(found) if one is PLAIN_KINDS[float] else found

    return Taken(words, take)


def _in_si(value: object, unit: str) -> object:
    """A quantity such as "210 GPa", alone or in a row, as a number in SI."""
    try:
        return value if unit == "1" else plain("", value, unit)
    except ConfigError as error:
        raise Unfit(value, "", sentence=f": {error}") from None


def _one_of(several: list[Taken | None]) -> Taken | None:
    takes = [take for take in several if take is not None and take is not NONE_ONLY]
    if None in several:
        return None
    words = _either([take.words for take in takes] + ["None"] * (NONE_ONLY in several))

    def take(value: object) -> object:
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


def _such(fits: Callable[[Any], object], become: Take = lambda value: value) -> Take:
    """Takes what fits, as it is or as what it becomes."""

    def take(value: object) -> object:
        if not fits(value):
            raise TypeError(value)
        return become(value)

    return take


def _word_of(known: tuple[object, ...]) -> Taken:
    def fits(value: npt.ArrayLike) -> bool:
        return not np.ndim(value) and value in known  # an array would be compared by entries

    take = _such(fits, lambda value: known[known.index(value)])
    return Taken(_either(list(map(repr, known))), take)


def _instance(kind: type) -> Taken:
    verbs = _verbs(kind)

    def fits(value: object) -> bool:
        if isinstance(value, type) and not issubclass(kind, type):
            return False  # it may have the verbs, but not the values
        known = (hasattr(type(value), verb) or hasattr(value, verb) for verb in verbs)
        return all(known) if verbs else isinstance(value, kind)

    source = SOURCES.get(kind.__name__)
    return Taken(f"of type {kind.__name__}" + (f" ({source})" if source else ""), _such(fits))


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

    def take(value: Iterable[object]) -> object:
        if isinstance(value, str) and one is ANY_TEXT:
            return kind([value])
        if isinstance(value, str | bytes | Mapping):
            raise TypeError(value)
        return kind(value if one is None else _each(one, enumerate(value)))

    return Taken("names" if one is ANY_TEXT else f"a sequence{what}", take)


def _row(takes: list[Taken | None]) -> Taken:
    each = [ANY_VALUE if take is None else take for take in takes]

    def fits(value: Sized) -> bool:
        return not isinstance(value, str | bytes | Mapping) and len(value) == len(each)

    def become(value: Iterable[object]) -> tuple[object, ...]:
        pairs = zip(each, enumerate(value), strict=True)
        return tuple(x for one, item in pairs for x in _each(one, [item]))

    take = _such(fits, become)
    return Taken(f"a row of {len(each)} ({', '.join(one.words for one in each)})", take)


def _each(one: Taken, items: Iterable[tuple[object, object]]) -> Iterator[object]:
    for key, x in items:
        try:
            yield one(x)
        except Unfit as unfit:
            raise unfit.within(f"[{shortened(key)}]") from unfit.__cause__


def _mapping(key: Taken | None, one: Taken | None) -> Taken:
    words = "a dictionary" + (f" whose values are {one.words}" if one else "")

    def become(value: Mapping[object, object]) -> Mapping[object, object]:
        for name in value:
            (key or ANY_VALUE)(name)
        # one that makes its values when they are asked for may take long: they are not asked for
        if one is None or not isinstance(value, dict | types.MappingProxyType):
            return value
        return dict(zip(value, _each(one, value.items()), strict=True))

    return Taken(words, _such(lambda value: isinstance(value, Mapping), become))


def _array(dtype: Any) -> Taken | None:
    """An array that was computed; whoever uses it judges its entries."""
    scalar = typing.get_origin(dtype) or dtype
    if scalar not in KINDS_OF_NUMBERS:
        return None
    kinds = KINDS_OF_NUMBERS[scalar]

    def take(value: object) -> object:
        found = _numbers(value, kinds)
        return value if isinstance(value, np.ndarray) else found.astype(scalar)

    words = {"iu": "an array of whole numbers", "b": "an array of True and False"}
    return Taken(words.get(kinds, "an array of numbers"), take)


def _array_like(value: object) -> object:
    found = _numbers(value, "iuf")
    for entry in (found.min(), found.max()) if found.size else ():
        _number(entry)
    return value


def _numbers(value: object, kinds: str) -> npt.NDArray[Any]:
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


def _is_whole(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, Integral):
        return False
    return abs(operator.index(value)) <= LARGEST_WHOLE


def _is_path(value: str | os.PathLike[str]) -> bool:
    text = os.fspath(value)
    return isinstance(text, str) and "\0" not in text


def _text(value: object) -> str:
    if not isinstance(value, str):
        name = getattr(value, "name", None)
        raise Unfit(value, "a text" + (f": write {name!r}" if isinstance(name, str) else ""))
    return value


ANY_VALUE = Taken("anything", lambda value: value)
NONE_ONLY = Taken("None", _such(lambda value: value is None))
ANY_TEXT = Taken("a text", _text)
ANY_FUNCTION = Taken("a function", _such(callable))
PLAIN_KINDS: dict[object, Taken | None] = {
    float: Taken("a finite number", _number),
    int: Taken("a whole number", _such(_is_whole, operator.index)),
    bool: Taken("True or False", _such(lambda value: isinstance(value, bool | np.bool_), bool)),
    str: ANY_TEXT,
    Path: Taken("a path", _such(_is_path)),
    npt.ArrayLike: Taken("finite numbers", _array_like),
    type(None): NONE_ONLY,
    None: NONE_ONLY,
    object: None,
    Any: None,
    Parameter.empty: None,
    Callable: ANY_FUNCTION,
}
