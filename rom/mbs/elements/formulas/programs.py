"""Formulas as functions of time, and of a coordinate and its rate."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import carray

from rom.mbs.elements.formulas.codes import MAX_STACK, MUL, NUMBER, PIECES, Code, T, V, X
from rom.mbs.elements.formulas.taylor import run
from rom.mbs.elements.law_calls import compiled_entry
from rom.mbs.kernels.compiled import kernel
from rom.mbs.parts.foreign import Entry
from rom.model import Array

Value = Any  # a number, or an array of them
# of a formula of a coordinate, as numba.cfunc takes it: t, x, v, program and answer
FORMULA_TYPES = "void(f8, f8, f8, CPointer(f8), CPointer(f8))"


@kernel
def sampled(program, given, by_time, out, stack):
    """Set the rows of out to values and derivatives, by time or by none, at rows t, x, v."""
    for k in range(given.shape[0]):
        t, x, v = given[k, 0], given[k, 1], given[k, 2]
        out[k] = run(program, (t, by_time, 0.0), (x, 0.0, 0.0), (v, 0.0, 0.0), stack)


def along_coordinate(t, x, v, program, answer):
    """Write value and derivatives by x and v; the program begins with the length of all."""
    given = carray(program, (int(carray(program, (1,))[0]),))
    stack, found = np.empty((MAX_STACK, 3)), carray(answer, (3,))
    time = (t, 0.0, 0.0)
    by_x = run(given[1:], time, (x, 1.0, 0.0), (v, 0.0, 0.0), stack)
    by_v = run(given[1:], time, (x, 0.0, 0.0), (v, 1.0, 0.0), stack)
    found[0], found[1], found[2] = by_x[0], by_x[1], by_v[1]


@cache
def entry() -> Entry:
    """The compiled `along_coordinate`."""
    return compiled_entry(along_coordinate, FORMULA_TYPES)


@dataclass(frozen=True, eq=False)
class Formula:
    """A formula of t, x and v."""

    program: Array  # (n,) as `rom.mbs.elements.formulas.taylor.run` takes it
    names: frozenset[str]  # the variables that stand in it

    def __call__(self, t: Value, x: Value = 0.0, v: Value = 0.0) -> Value:
        """Its value; of arrays each to each."""
        return self._sampled(t, x, v)[..., 0] if np.ndim(t) else float(self._sampled(t, x, v)[0])

    def rate(self, t: Value) -> Value:
        """Its first derivative by time."""
        return self._sampled(t, by_time=1.0)[..., 1]

    def acceleration(self, t: Value) -> Value:
        """Its second derivative by time."""
        return self._sampled(t, by_time=1.0)[..., 2]

    @property
    def address(self) -> int:
        """Of the compiled function that answers for it, see `along_coordinate`."""
        return int(entry().address)

    def _sampled(
        self, t: npt.ArrayLike, x: npt.ArrayLike = 0.0, v: npt.ArrayLike = 0.0, by_time: float = 0.0
    ) -> Array:
        given = np.stack(np.broadcast_arrays(t, x, v), axis=-1).astype(float)
        out = np.empty((given.size // 3, 3))
        sampled(self.program, given.reshape(-1, 3), by_time, out, np.empty((MAX_STACK, 3)))
        return out.reshape(given.shape)


def formula(code: Code, factor: float = 1.0) -> Formula:
    """The formula of some instructions, times a factor."""
    if factor != 1.0:
        code = (*code, (NUMBER, factor), (MUL, 0.0))
    found = {instruction for instruction, _ in code}
    names = frozenset(name for name, one in (("t", T), ("x", X), ("v", V)) if one in found)
    return Formula(np.array([len(code), *np.ravel(code)], dtype=float), names)


def piecewise(knots: Array, centres: Array, coefficients: Array) -> Formula:
    """Piecewise polynomials of x, the first and the last of which reach on for ever.

    They meet at knots (n - 1,), ascending; coefficients (n, k) about centres (n,), highest first.
    """
    n, k = coefficients.shape
    table = np.column_stack([centres, coefficients]).ravel()
    code = [2.0, X, 0.0, PIECES, 5.0]
    return Formula(np.concatenate([code, [n, k], knots, table]), frozenset("x"))
