"""How compiled code reads a table: one pointer to words, see `rom.mbs.kernels.tables`."""

import operator
from collections.abc import Callable
from typing import Any, ClassVar

from llvmlite import ir
from numba import types
from numba.core.base import BaseContext
from numba.core.datamodel import DataModelManager
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.arraydecl import GetItemBuffer, SetItemBuffer
from numba.core.typing.templates import AttributeTemplate, infer_getattr, infer_global
from numba.extending import NativeValue, models, register_model, unbox
from numba.np.arrayobj import populate_array

TABLE_WORD = ir.IntType(64)
WORD_SIZE = 8  # of all entries, real and whole numbers both [bytes]


class TableType(types.Type):
    """Type of a table in compiled code; its class says what is in it."""

    def __init__(self, cls: Any):
        self.cls = cls
        super().__init__(f"{cls.__module__}.{cls.__qualname__}")


def number(value: int) -> ir.Constant:
    """A whole number in compiled code."""
    return ir.Constant(TABLE_WORD, value)


def pointer(builder: ir.IRBuilder, address: ir.Value) -> ir.Value:
    """The table at an address."""
    return builder.inttoptr(address, TABLE_WORD.as_pointer())


def word(builder: ir.IRBuilder, table: ir.Value, at: ir.Value) -> ir.Value:
    """A word of a table, at a place that compiled code has."""
    return builder.load(builder.gep(table, [at]))


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
    def __init__(self, manager: DataModelManager, kind: TableType):
        super().__init__(manager, kind, TABLE_WORD.as_pointer())


@unbox(TableType)
def _unbox(kind: TableType, value: ir.Value, c: Any) -> NativeValue:
    found = c.pyapi.object_getattr_string(value, "_address")
    address = c.pyapi.long_as_longlong(found)
    c.pyapi.decref(found)
    return NativeValue(pointer(c.builder, address))


@infer_getattr
class _Fields(AttributeTemplate):
    key = TableType

    def generic_resolve(self, kind: TableType, name: str) -> types.Type | None:
        return kind.cls._layout[name][1] if name in kind.cls._layout else None


@lower_getattr_generic(TableType)
def _field(
    context: BaseContext, builder: ir.IRBuilder, kind: TableType, value: ir.Value, name: str
) -> ir.Value:
    at, field = kind.cls._layout[name]

    def read(k: int) -> ir.Value:
        found = word(builder, value, number(at + k))
        # the words never change while a kernel runs: they are read once, before its loops
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    if field is types.int64:
        return read(0)
    if isinstance(field, TableType):
        return pointer(builder, read(0))
    return _array(context, builder, field, read)


def _array(
    context: BaseContext, builder: ir.IRBuilder, kind: types.Array, read: Callable[[int], ir.Value]
) -> ir.Value:
    """The view of an array whose address and shape are told."""
    array = context.make_array(kind)(context, builder)
    shape = [read(1 + k) for k in range(kind.ndim)]
    stride = number(WORD_SIZE)
    strides = [stride]
    for length in shape[:0:-1]:
        stride = builder.mul(stride, length)
        strides.insert(0, stride)
    populate_array(
        array,
        data=builder.inttoptr(read(0), context.get_data_type(kind.dtype).as_pointer()),
        shape=shape,
        strides=strides,
        itemsize=number(WORD_SIZE),
        meminfo=None,
    )
    return array._getvalue()
