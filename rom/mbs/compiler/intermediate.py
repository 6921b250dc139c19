"""The compiler of functions that only compiled code calls.

Numba optimises every function and makes machine code of it, also of one that is then built into
all its callers, and optimised there once more: that took more than a third of the time. Here such a
function stays as it is written, until a caller that runs takes it in.
"""

from llvmlite import ir
from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, StateDict
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class IntermediateCode(JITCodeLibrary):
    """Code that becomes part of other code, and is optimised and made executable there."""

    def _optimize_functions(self, module: ir.Module) -> None:
        module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Say that nothing more is added."""
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class IntermediateLowering(NativeLowering):
    """The last pass of a compiler that leaves out machine code."""

    _name = "intermediate_lowering"

    def run_pass(self, state: StateDict) -> bool:
        """Make the code of a function, and let others call it."""
        context = state.targetctx
        state.flags.no_compile = True
        state.library = IntermediateCode(context.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        made, parts = state["cr"], [state.library, *state.library._linking_libraries]
        # what Numba knows a function by; called from Python it would jump to the address 0
        entry = make_function(made.fndesc.lookup_module(), "inner", "", 0, made.env, ())
        context.insert_user_function(entry, made.fndesc, list(dict.fromkeys(parts)))
        state["cr"] = made._replace(cfunc=entry)
        return True


class IntermediateCompiler(CompilerBase):
    """A compiler of functions that only compiled code calls."""

    def define_pipelines(self) -> list[PassManager]:
        """The passes of all functions but for the last one."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        last = {NativeLowering: IntermediateLowering}
        passes.passes = [(last.get(one, one), why) for one, why in passes.passes]
        passes.finalize()
        return [passes]


# of functions that only compiled code calls
INTERMEDIATE_OPTIONS = {
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": IntermediateCompiler,
}
