"""The compiler of the kernels; `rom.mbs.compiler.cache` keeps what it makes."""

from typing import Any

import numba
from llvmlite import ir
from numba import types

from rom.mbs.compiler.cache import kept
from rom.mbs.compiler.intermediate import INTERMEDIATE_OPTIONS

# reassociation lets sums be vectorised; NaN and infinity keep their meaning. No kernel makes an
# array, so none counts references to them: a step took four times as long when all did
OPTIONS = {
    "cache": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc"},
}

INNER_OPTIONS = OPTIONS | {"cache": False} | INTERMEDIATE_OPTIONS
# callable from Python
kernel = kept(numba.njit(**OPTIONS), entry=True)
# callable from other kernels only, which alone are kept
inner = numba.njit(**INNER_OPTIONS)
# for functions that return a part of an array, which compiled functions without counting cannot
spliced = kept(numba.njit(**OPTIONS, inline="always"))


@inner
def copy(x, out):
    """Write the array x into out, which has its shape; ``out[:] = x`` would make an array."""
    for i in range(x.size):
        out.flat[i] = x.flat[i]


def called(signature: Any) -> tuple[Any, Any]:
    """What an intrinsic gives back that calls the function of C at its first argument.

    Numbers are handed on as they are, arrays by the address of their first number.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds, given = [], []
        for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
            array = isinstance(kind, types.Array)
            given.append(context.make_array(kind)(context, builder, value).data if array else value)
            kinds.append(given[-1].type)
        nothing = signature.return_type == types.void
        back = ir.VoidType() if nothing else context.get_value_type(signature.return_type)
        code = builder.inttoptr(arguments[0], ir.FunctionType(back, kinds).as_pointer())
        answer = builder.call(code, given)
        return context.get_dummy_value() if nothing else answer

    return signature, build
