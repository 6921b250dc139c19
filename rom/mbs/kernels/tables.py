"""Tables: classes of arrays that compiled code receives as one address.

Numba passes a tuple of arrays as seven numbers per array, at every call and into every compiled
function: with two hundred arrays that is most of the time to compile. A table is one pointer to
whole numbers, the address and the shape of each of its arrays; compiled code reads of them what it
names, so that kernels are written as if the table were a tuple.
"""

import operator
from collections.abc import Iterator
from dataclasses import dataclass
from typing import (
    Annotated,
    Any,
    ClassVar,
    Self,
    TypeVar,
    dataclass_transform,
    get_args,
    get_type_hints,
)

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.arraydecl import GetItemBuffer, SetItemBuffer
from numba.core.typing.templates import AttributeTemplate, infer_getattr, infer_global
from numba.extending import NativeValue, models, register_model, unbox
from numba.np.arrayobj import populate_array

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
TABLE_WORD = ir.IntType(64)
WORD_SIZE = 8  # of all entries, real and whole numbers both [bytes]
T = TypeVar("T")


class TableType(types.Type):
    """Type of a table in compiled code; its class says what is in it."""

    def __init__(self, cls: type):
        self.cls = cls
        super().__init__(f"{cls.__module__}.{cls.__qualname__}")


class Table:
    """Base of all tables, see `table`."""

    __slots__ = ("_address", "_words")
    _address: int
    _words: Any
    _numba_type_: Any
    _layout: dict[str, tuple[int, Any]]  # first word and type of each field
    _passing: frozenset[str]  # fields marked so

    def __post_init__(self) -> None:
        words: list[int] = []
        for name, (_, kind) in self._layout.items():
            words += _words(getattr(self, name), kind, f"{type(self).__name__}.{name}")
        object.__setattr__(self, "_words", np.array(words, dtype=np.int64))
        object.__setattr__(self, "_address", self._words.ctypes.data)

    def __reduce__(self) -> Any:
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

    Raises:
        TypeError: when one is made, if an array has another type, or is not in one piece.
    """
    made: Any = dataclass(frozen=True, eq=False, slots=True)(cls)
    made._numba_type_ = TableType(made)
    made._layout, at = {}, 0
    hints = get_type_hints(made, include_extras=True)
    made._passing = frozenset(
        name for name, hint in hints.items() if PASSING_MARK in get_args(hint)
    )
    for name, hint in hints.items():
        if name.startswith("_"):
            continue
        kind = _kind(hint)
        made._layout[name] = (at, kind)
        at += 1 + getattr(kind, "ndim", 0)
    return made


def _kind(hint: Any) -> Any:
    """Type of a field in compiled code."""
    for part in (hint, *get_args(hint)):
        if isinstance(part, types.Array):
            return part
        if isinstance(part, type) and issubclass(part, Table):
            return part._numba_type_
    return types.int64


def _words(value: Any, kind: Any, what: str) -> list[int]:
    """What a table says of one of its fields."""
    if isinstance(kind, TableType):
        return [0 if value is None else value._address]
    if kind is types.int64:
        return [int(value)]
    if value.dtype != kind.dtype.name or value.ndim != kind.ndim or not value.flags.c_contiguous:
        raise TypeError(
            f"{what} is an array of {value.dtype} with strides {value.strides}, not {kind}."
        )
    return [value.ctypes.data, *value.shape]


# Numba asks what lists, strings and dates would do with an index before it asks what an array does,
# which takes a fifth of its time; what belongs to a target comes first
@infer_global(operator.getitem)
class _Entry(GetItemBuffer):
    metadata: ClassVar = {"target": "cpu"}


@infer_global(operator.setitem)
class _NewEntry(SetItemBuffer):
    metadata: ClassVar = {"target": "cpu"}


@register_model(TableType)
class _Pointer(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any):
        super().__init__(manager, kind, TABLE_WORD.as_pointer())


@unbox(TableType)
def _unbox(kind: Any, value: Any, c: Any) -> Any:
    number = c.pyapi.object_getattr_string(value, "_address")
    address = c.pyapi.long_as_longlong(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.inttoptr(address, TABLE_WORD.as_pointer()))


@infer_getattr
class _Fields(AttributeTemplate):
    key = TableType

    def generic_resolve(self, kind: Any, name: str) -> Any:
        return kind.cls._layout[name][1] if name in kind.cls._layout else None


@lower_getattr_generic(TableType)
def _field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    at, field = kind.cls._layout[name]

    def word(k: int) -> Any:
        found = builder.load(builder.gep(value, [ir.Constant(TABLE_WORD, at + k)]))
        # the words never change while a kernel runs: they are read once, before its loops
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    if field is types.int64:
        return word(0)
    if isinstance(field, TableType):
        return builder.inttoptr(word(0), TABLE_WORD.as_pointer())
    return _array(context, builder, field, word)


def _array(context: Any, builder: Any, kind: Any, word: Any) -> Any:
    """The view of an array whose address and shape are told."""
    array = context.make_array(kind)(context, builder)
    shape = [word(1 + k) for k in range(kind.ndim)]
    stride = ir.Constant(TABLE_WORD, WORD_SIZE)
    strides = [stride]
    for length in shape[:0:-1]:
        stride = builder.mul(stride, length)
        strides.insert(0, stride)
    populate_array(
        array,
        data=builder.inttoptr(word(0), context.get_data_type(kind.dtype).as_pointer()),
        shape=shape,
        strides=strides,
        itemsize=ir.Constant(TABLE_WORD, WORD_SIZE),
        meminfo=None,
    )
    return array._getvalue()
