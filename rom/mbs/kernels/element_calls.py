"""Kernels of elements, which the equations call through addresses without knowing any of them.

The system has one row of whole numbers per family of elements that occurs in it: the address of
its table, and those of its kernels. A family is compiled when a mechanism first has one of it.
"""

from collections.abc import Callable
from typing import Any

from numba import config, njit, types

from rom.mbs.compiler import calls
from rom.mbs.compiler.cache import Function, kept
from rom.mbs.compiler.calls import address_of, call_at, let_kernels_call
from rom.mbs.compiler.table_types import number, pointer, word
from rom.mbs.kernels.compiled import OPTIONS
from rom.mbs.kernels.stages import REAL_VECTOR
from rom.mbs.kernels.system import System
from rom.mbs.kernels.tables import Table
from rom.mbs.kernels.work import Work

ROW_WORDS = 6  # of a family: its table, then its kernels in the order of their columns
PYTHON_OBJECTS: dict[int, Any] = {}  # tables and kernels by address, where Python runs the kernels
SYSTEM_TYPE, WORK_TYPE = System._numba_type_, Work._numba_type_


class ElementKernel:
    """A kernel of one family, which takes system, work and its table; compiled when needed."""

    def __init__(self, function: Function, signature: calls.Signature):
        compiler = njit(**OPTIONS, no_cpython_wrapper=True, no_cfunc_wrapper=True)
        self.kernel, self.signature = kept(compiler)(function), signature
        self._address = 0

    def link(self) -> int:
        """Address of the compiled code."""
        if config.DISABLE_JIT:
            PYTHON_OBJECTS[id(self)] = self.kernel
            return id(self)
        if not self._address:
            self._address = address_of(self.kernel, self.signature)
        return self._address


class Role:
    """What a kernel is for: ``role(s, k, W, ...)`` in a kernel calls that of family k.

    It stands in a column of the row of a family; types are of what follows system, work and table.
    """

    def __init__(self, column: int, result: types.Type, *types_: types.Type):
        self.column, self.result, self.types = column, result, types_
        signature = result(SYSTEM_TYPE, types.intp, WORK_TYPE, *types_)
        let_kernels_call(self, f"Role{column}", signature, self._call)

    def of(self, table: type[Table]) -> Callable[[Function], ElementKernel]:
        """Make a function the kernel in this role of the family with this class of table."""
        signature = self.result(SYSTEM_TYPE, WORK_TYPE, table._numba_type_, *self.types)
        return lambda function: ElementKernel(function, signature)

    def __call__(self, s: System, k: int, W: Work, *arguments: object) -> Any:
        """The call where Python runs the kernels."""
        table, kernel = (int(s.elements[k, c]) for c in (0, self.column))
        return PYTHON_OBJECTS[kernel](s, W, PYTHON_OBJECTS[table], *arguments) if kernel else 0.0

    def _call(
        self,
        context: calls.Context,
        builder: calls.Builder,
        signature: calls.Signature,
        values: calls.Values,
    ) -> calls.Value:
        s, k, W, *arguments = values
        rows = pointer(builder, word(builder, s, number(System._layout["elements"][0])))
        first = builder.mul(k, number(ROW_WORDS))
        places = (builder.add(first, number(column)) for column in (0, self.column))
        table, address = (word(builder, rows, place) for place in places)
        # all tables are one address to compiled code: that of any class stands for the others
        called = self.result(SYSTEM_TYPE, WORK_TYPE, SYSTEM_TYPE, *self.types)
        values = [s, W, pointer(builder, table), *arguments]
        return call_at(context, builder, called, address, values)


# (s, k, W, q, v, lam): add wrenches on markers, forces to W.residual and powers to W.power
residuals = Role(1, types.void, REAL_VECTOR, REAL_VECTOR, REAL_VECTOR)
# (s, k, W, lam, ck, cc): add stiffness times ck to W.Kt and damping times cc to W.S, all of it
# right after the residuals
tangents = Role(2, types.void, REAL_VECTOR, types.float64, types.float64)
# (s, k, W, q, v): stored energy
energy = Role(3, types.float64, REAL_VECTOR, REAL_VECTOR)
# (s, k, W, lam, rank): add to W.UG how the forces change with the multipliers
multiplier_columns = Role(4, types.void, REAL_VECTOR, types.int64)
# (s, k, W, ck, cc, first): write ck times the stiffness and cc times the damping that the motion of
# marker i against j meets to W.pairs, element by element from place ``first``, right after the
# residuals; how many they are
pair_tangents = Role(5, types.int64, types.float64, types.float64, types.int64)


def row_of(table: Table, kernels: tuple[ElementKernel | None, ...]) -> list[int]:
    """The row of a family; its kernels are compiled."""
    if config.DISABLE_JIT:
        PYTHON_OBJECTS[table._address] = table
    return [table._address, *(0 if kernel is None else kernel.link() for kernel in kernels)]
