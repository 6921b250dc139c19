"""Stages: kernels that are compiled alone, and called by other kernels through their address.

A kernel that calls another one takes its code into its own, and all of it is optimised once more.
A stage is compiled once, whoever calls it, and only for systems that need it; its address stands
in a table that the system begins with.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils, config
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import TypingError
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin

from rom.mbs.compiler.cache import CODE_FILES, EXPECTED_FUNCTIONS, kept
from rom.mbs.kernels.compiled import OPTIONS
from rom.mbs.kernels.tables import TABLE_WORD

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


def _always(_: Any) -> bool:
    return True


class Stage:
    """A kernel with a fixed signature, callable from Python and, once linked, from kernels.

    Its first argument is the system. A call in a kernel does nothing, and answers 0, unless some
    system, or step, of this process needed it.

    Attributes:
        signature: types of result and arguments.
        kernel: the compiled function.
        asked: class of the table that needs it or not.
        needed: whether such a table does.
        slot: its place in `STAGE_ADDRESSES`.
    """

    def __init__(
        self, function: Callable[..., Any], types_: Any, asked: type, needed: Callable[[Any], Any]
    ):
        result, *arguments = (getattr(kind, "_numba_type_", kind) for kind in types_)
        self.signature, self.asked, self.needed = result(*arguments), asked, needed
        self.kernel = kept(njit(**OPTIONS, no_cfunc_wrapper=True))(function)
        self.slot = STAGE_NAMES.index(function.__name__)
        STAGE_KERNELS[function.__name__] = self
        called = {"key": self, "generic": lambda typing, given, _: self._typed(typing, given)}
        infer_global(self, types.Function(type(function.__name__, (AbstractTemplate,), called)))
        lower_builtin(self, types.VarArg(types.Any))(self._call)

    @property
    def linked(self) -> bool:
        """Whether kernels can call it; as they are in Python they always can."""
        return bool(STAGE_ADDRESSES[self.slot]) or config.DISABLE_JIT

    def link(self) -> None:
        """Compile it, or take it from the cache, unless that has been done."""
        if not self.linked:
            STAGE_ADDRESSES[self.slot] = address_of(self.kernel, self.signature)

    def __call__(self, *arguments: Any) -> Any:
        """Run it from Python."""
        return self.kernel(*arguments)

    def _typed(self, typing: Any, given: Any) -> Any:
        """The signature, for a call in a kernel."""
        for kind, asked in zip(given, self.signature.args, strict=True):
            if typing.context.can_convert(kind, asked) is None:
                raise TypingError(f"{self.kernel.__name__} takes {asked}, not {kind}.")
        return self.signature

    def _call(self, context: Any, builder: Any, signature: Any, values: Any) -> Any:
        """What a call in a kernel becomes."""
        addresses = builder.inttoptr(builder.load(values[0]), TABLE_WORD.as_pointer())
        address = builder.load(builder.gep(addresses, [ir.Constant(TABLE_WORD, self.slot)]))
        return call_at(context, builder, signature, address, values)


def address_of(kernel: Any, signature: Any) -> int:
    """Address of the compiled form of a kernel, which takes no other types from then on."""
    with global_compiler_lock:  # of two threads the second finds it compiled
        if signature.args not in kernel.overloads:
            kernel.compile(signature)
            kernel.disable_compile()
    compiled = kernel.overloads[signature.args]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def call_at(context: Any, builder: Any, signature: Any, address: Any, values: Any) -> Any:
    """What a call of the kernel at an address becomes: its answer, 0 if the address is 0."""
    result, arguments = signature.return_type, signature.args
    kind = context.call_conv.get_function_type(result, arguments)
    code = builder.inttoptr(address, kind.as_pointer())
    answer = cgutils.alloca_once_value(builder, context.get_constant_null(result))
    with builder.if_then(cgutils.is_not_null(builder, code), likely=True):
        _, given = context.call_conv.call_function(builder, code, result, arguments, values)
        builder.store(given, answer)
    return builder.load(answer)


def stage(
    *types_: Any, asked: type | None = None, needed: Callable[[Any], Any] = _always
) -> Callable[[Any], Stage]:
    """Make a function a stage.

    Args:
        types_: of the result and of the arguments, classes of tables or types of Numba.
        asked: class of the tables that may need it; None for systems.
        needed: table -> whether it needs this stage; always unless told.
    """
    return lambda function: Stage(function, types_, asked or types_[1], needed)


def needed_by(table: Any) -> set[str]:
    """Names of the stages that a system or a step needs."""
    return {n for n, s in STAGE_KERNELS.items() if isinstance(table, s.asked) and s.needed(table)}


def link(table: Any) -> None:
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
