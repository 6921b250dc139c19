"""Calls from compiled code through addresses, and addresses of compiled code."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.ccallback import CFunc
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.core.errors import TypingError
from numba.core.sigutils import normalize_signature
from numba.core.typing import Signature as Signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin

from rom.mbs.compiler.cache import Function, guard

Context: TypeAlias = BaseContext  # of a compilation
Builder: TypeAlias = ir.IRBuilder
Value: TypeAlias = ir.Value
Values = Sequence[Value]
# what a call becomes
Build = Callable[[Context, Builder, Signature, Values], Value]


def let_kernels_call(thing: object, name: str, signature: Signature, build: Build) -> None:
    """Make an object of Python callable in kernels; ``build`` is what a call becomes."""

    def typed(template: AbstractTemplate, given: Sequence[types.Type], _: object) -> Signature:
        for kind, asked in zip(given, signature.args, strict=True):
            if template.context.can_convert(kind, asked) is None:
                raise TypingError(f"{name} takes {asked}, not {kind}.")
        return signature

    template = type(name, (AbstractTemplate,), {"key": thing, "generic": typed})
    infer_global(thing, types.Function(template))
    lower_builtin(thing, types.VarArg(types.Any))(build)


def address_of(kernel: Dispatcher, signature: Signature) -> int:
    """Address of the compiled form of a kernel, which takes no other types from then on."""
    with global_compiler_lock:  # of two threads the second finds it compiled
        if signature.args not in kernel.overloads:
            kernel.compile(signature)
            kernel.disable_compile()
    compiled = kernel.overloads[signature.args]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def call_at(
    context: Context, builder: Builder, signature: Signature, address: Value, values: Values
) -> Value:
    """What a call of the kernel at an address becomes: its answer, 0 if the address is 0."""
    result, arguments = signature.return_type, signature.args
    kind = context.call_conv.get_function_type(result, arguments)
    code = builder.inttoptr(address, kind.as_pointer())
    answer = cgutils.alloca_once_value(builder, context.get_constant_null(result))
    with builder.if_then(cgutils.is_not_null(builder, code), likely=True):
        _, given = context.call_conv.call_function(builder, code, result, arguments, values)
        builder.store(given, answer)
    return builder.load(answer)


def called(signature: Signature) -> tuple[Signature, Build]:
    """What an intrinsic gives back that calls the function of C at its first argument.

    Numbers are handed on as they are, arrays by the address of their first number.
    """

    def build(context: Context, builder: Builder, signature: Signature, arguments: Values) -> Value:
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


def c_function(function: Function, types: str, options: dict[str, object]) -> CFunc:
    """A function of C, compiled and kept, with attribute ``address``.

    ``options`` are those of Numba that its decorator would not take.
    """
    made = CFunc(function, normalize_signature(types), {}, options)
    made.enable_caching()
    guard(made, function)
    made.compile()
    return made
