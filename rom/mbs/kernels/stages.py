"""Stages: kernels that are compiled alone, and called by other kernels through their address.

A kernel that calls another one takes its code into its own, and all of it is optimised once more.
A stage is compiled once, whoever calls it, and only for systems that need it; its address stands
in a table that the system begins with.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numba import config, njit, types

from rom.mbs.compiler import calls
from rom.mbs.compiler.cache import CODE_FILES, EXPECTED_FUNCTIONS, Function, kept
from rom.mbs.compiler.calls import address_of, call_at, let_kernels_call
from rom.mbs.compiler.table_types import number, pointer, word
from rom.mbs.kernels.compiled import OPTIONS

Needed = Callable[[Any], object]  # of a table: whether it needs a stage
REAL_VECTOR = types.Array(types.float64, 1, "A")  # a row or a column of a table
REAL_MATRIX = types.Array(types.float64, 2, "C")
REAL_BLOCK = types.Array(types.float64, 2, "A")  # rows and columns of a matrix
THREE_FACTORS = types.UniTuple(types.float64, 3)
# Compiled code knows a stage by its place here, whatever is imported first.
STAGE_NAMES = (
    "evaluate residual tangents constraint_gradient factorise_bordered solve_bordered "
    "gradient_times factorise_motion accelerate advance factorise_blocks fill_from_blocks "
    "solve_blocks solve_sharing remove_undecided constraint_range least_multipliers "
    "elastic_damping elastic_stiffness bent_coordinates bent_integrals bent_mass bent_damping "
    "bent_motion bent_stiffness bent_wrench_stiffness coordinate_states coupling_row "
    "coupling_stiffness velocity_gaps close_gaps fit_velocities predict_multistep follow_increment "
    "keep_past rolling_row rolling_stiffness keep_pair_tangents renew_pair_tangents add_renewed "
    "fitted_motion fitted_wrench_stiffness"
).split()
STAGE_KERNELS: dict[str, "Stage"] = {}
STAGE_ADDRESSES = np.zeros(len(STAGE_NAMES), dtype=np.int64)  # 0 until a stage is linked


class Stage:
    """A kernel with a fixed signature, callable from Python and, once linked, from kernels.

    Its first argument is the system. A call in a kernel does nothing, and answers 0, unless some
    system, or step, of this process ``needed`` it, a table of the class ``asked``.
    """

    def __init__(self, function: Function, types_: Sequence[Any], asked: type, needed: Needed):
        result, *arguments = (getattr(kind, "_numba_type_", kind) for kind in types_)
        self.signature, self.asked, self.needed = result(*arguments), asked, needed
        self.kernel = kept(njit(**OPTIONS, no_cfunc_wrapper=True))(function)
        self.slot = STAGE_NAMES.index(function.__name__)
        STAGE_KERNELS[function.__name__] = self
        let_kernels_call(self, function.__name__, self.signature, self._call)

    @property
    def linked(self) -> bool:
        """Whether kernels can call it; as they are in Python they always can."""
        return bool(STAGE_ADDRESSES[self.slot]) or config.DISABLE_JIT

    def link(self) -> None:
        """Compile it, or take it from the cache, unless that has been done."""
        if not self.linked:
            STAGE_ADDRESSES[self.slot] = address_of(self.kernel, self.signature)

    def __call__(self, *arguments: object) -> Any:
        """Run it from Python."""
        return self.kernel(*arguments)

    def _call(
        self,
        context: calls.Context,
        builder: calls.Builder,
        signature: calls.Signature,
        values: calls.Values,
    ) -> calls.Value:
        """What a call in a kernel becomes."""
        addresses = pointer(builder, word(builder, values[0], number(0)))
        address = word(builder, addresses, number(self.slot))
        return call_at(context, builder, signature, address, values)


def stage(
    *types_: Any, asked: type | None = None, needed: Needed = lambda _: True
) -> Callable[[Function], Stage]:
    """Make a function a stage, of the types of its result and arguments: tables or types of Numba.

    Tables of the class ``asked``, systems unless told, may need it; ``needed`` says if one does.
    """
    return lambda function: Stage(function, types_, asked or types_[1], needed)


def needed_by(table: object) -> set[str]:
    """Names of the stages that a system or a step needs."""
    return {n for n, s in STAGE_KERNELS.items() if isinstance(table, s.asked) and s.needed(table)}


def link(table: object) -> None:
    """Compile all stages that a system or a step needs, before kernels call them.

    What another process compiles just now comes last, so that two share the work.
    """
    asked = needed_by(table)
    needed = [one for name, one in STAGE_KERNELS.items() if name in asked and not one.linked]
    EXPECTED_FUNCTIONS.update(one.kernel.py_func for one in needed)
    later = []
    for one in needed:
        if CODE_FILES[one.kernel.py_func].made_elsewhere():
            later.append(one)
        else:
            one.link()
    for one in later:
        one.link()
