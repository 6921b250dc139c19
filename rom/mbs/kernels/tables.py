"""Tables: classes of arrays that compiled code receives as one address.

Numba passes a tuple of arrays as seven numbers per array, at every call and into every compiled
function: with two hundred arrays that is most of the time to compile. A table is one pointer to
whole numbers, the address and the shape of each of its arrays; compiled code reads of them what it
names, so that kernels are written as if the table were a tuple.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Self, TypeVar, dataclass_transform, get_args, get_type_hints

import numpy as np
from numba import types

from rom.mbs.compiler.table_types import TableType
from rom.model import Array, Index

Array1 = Annotated[Array, types.Array(types.float64, 1, "C")]
Array2 = Annotated[Array, types.Array(types.float64, 2, "C")]
Array3 = Annotated[Array, types.Array(types.float64, 3, "C")]
Array4 = Annotated[Array, types.Array(types.float64, 4, "C")]
Index1 = Annotated[Index, types.Array(types.int64, 1, "C")]
Index2 = Annotated[Index, types.Array(types.int64, 2, "C")]
# of fields that differ between processes or from one instant to the next: they do not tell a
# mechanism from another
PASSING_MARK = "passing"
Address1 = Annotated[Index, types.Array(types.int64, 1, "C"), PASSING_MARK]
Address2 = Annotated[Index, types.Array(types.int64, 2, "C"), PASSING_MARK]
Scratch1 = Annotated[Array, types.Array(types.float64, 1, "C"), PASSING_MARK]
Scratch2 = Annotated[Array, types.Array(types.float64, 2, "C"), PASSING_MARK]
Scratch3 = Annotated[Array, types.Array(types.float64, 3, "C"), PASSING_MARK]
T = TypeVar("T")


class Table:
    """Base of all tables, see `table`."""

    __slots__ = ("_address", "_words")
    _address: int
    _words: Index
    _numba_type_: TableType
    _layout: dict[str, tuple[int, types.Type]]  # first word and type of each field
    _passing: frozenset[str]  # fields marked so

    def __post_init__(self) -> None:
        words: list[int] = []
        for name, (_, kind) in self._layout.items():
            words += _words(getattr(self, name), kind, f"{type(self).__name__}.{name}")
        object.__setattr__(self, "_words", np.array(words, dtype=np.int64))
        object.__setattr__(self, "_address", self._words.ctypes.data)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), tuple(value for _, value in self.items())

    def items(self) -> Iterator[tuple[str, Any]]:
        """Name and value of each field."""
        return ((name, getattr(self, name)) for name in self._layout)

    def replace(self, **fields: Any) -> Self:
        """A copy with other values of some fields."""
        return type(self)(**dict(self.items()) | fields)


@dataclass_transform(frozen_default=True)
def table(cls: type[T]) -> type[T]:
    """Make a table of a class whose fields are arrays, other tables and whole numbers.

    Making one of wrong types, or of arrays not in one piece, is a TypeError.
    """
    made: Any = dataclass(frozen=True, eq=False, slots=True)(cls)
    made._numba_type_ = TableType(made)
    made._layout, at = {}, 0
    hints = get_type_hints(made, include_extras=True)
    made._passing = frozenset(x for x, hint in hints.items() if PASSING_MARK in get_args(hint))
    for name, hint in hints.items():
        if name.startswith("_"):
            continue
        kind = _kind(hint)
        made._layout[name] = (at, kind)
        at += 1 + getattr(kind, "ndim", 0)
    return made


def _kind(hint: object) -> types.Type:
    """Type of a field in compiled code."""
    for part in (hint, *get_args(hint)):
        if isinstance(part, types.Array):
            return part
        if isinstance(part, type) and issubclass(part, Table):
            return part._numba_type_
    return types.int64


def _words(value: Any, kind: types.Type, what: str) -> list[int]:
    """What a table says of one of its fields."""
    if isinstance(kind, TableType):
        return [0 if value is None else value._address]
    if kind is types.int64:
        return [int(value)]
    if value.dtype != kind.dtype.name or value.ndim != kind.ndim or not value.flags.c_contiguous:
        given = f"{value.dtype} with strides {value.strides}"
        raise TypeError(f"{what} is an array of {given}, not {kind}.")
    return [value.ctypes.data, *value.shape]
