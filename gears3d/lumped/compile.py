"""Compilation of the kernels' inner functions: only compiled code calls them, and they are cached with their entry.

Numba optimises and translates every function with a copy of all that it calls, so that a function five levels below the
entry goes through LLVM five times. An inner function is therefore only lowered to LLVM's language; the entry that calls
it links all of them, and optimises and translates them once. That takes half of the time, and gives the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from numba import _dynfunc, types  # type: ignore[attr-defined]
from numba.core import cgutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import IRLegalization, NativeLowering
from numba.extending import intrinsic

from gears3d.kernels import njit


class _Lowered(JITCodeLibrary):
    """Code in LLVM's language, left to those that link it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _KeepLowered(LoweringPass):
    """Take a library that is not translated; runs before the lowering."""

    _name = "keep_lowered"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state) -> bool:
        state.library = _Lowered(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        return False


@register_pass(mutates_CFG=False, analysis_only=True)
class _MakeCallable(LoweringPass):
    """Let compiled code call what has been lowered; runs after the lowering."""

    _name = "make_callable"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state) -> bool:
        lowered = state["cr"]
        name = lowered.fndesc.qualname.split(".")[-1]
        key = _dynfunc.make_function(lowered.fndesc.lookup_module(), name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return False


class _Inner(CompilerBase):
    """Numba's own passes, with the two above."""

    def define_pipelines(self) -> list:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_KeepLowered, IRLegalization)
        passes.add_pass_after(_MakeCallable, NativeLowering)
        passes.finalize()
        return [passes]


def inner(function: Callable[..., Any], forceinline: bool = False) -> Any:
    """Return a function that only compiled code calls, compiled once whether its numbers are written out or computed.

    Divisions are not checked one by one (a motion that is not finite ends the run). Products are never fused with sums:
    the compiler would do so here and not there, and a kernel from the cache would differ from a fresh one in the last
    digit.

    Args:
        function: decorated.
        forceinline: whether its code replaces every call.
    """
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
    made: Any = njit(function, forceinline=forceinline, pipeline_class=_Inner, **options)  # type: ignore[call-overload]
    template = made.get_call_template
    made.get_call_template = lambda args, kws: template(
        tuple(types.unliteral(one) for one in args), {name: types.unliteral(one) for name, one in kws.items()}
    )
    return made


tight = partial(inner, forceinline=True)
"""Decorator of what every step calls: what is not asked for is not computed."""


def entry(function: Callable[..., Any]) -> Any:
    """Return a function that Python calls, kept on disk and run without Python's lock.

    Args:
        function: decorated; all that it calls is an :func:`inner` function or another entry.
    """
    made: Any = njit(function, cache=True, nogil=True, error_model="numpy")  # type: ignore[call-overload]
    compiling = made._compile_for_args
    made._compile_for_args = lambda *args, **kws: _with_room(compiling, args, kws)
    return made


def _with_room(call, args, kws):
    """Call with half a megabyte of Python's stack in one piece.

    Python 3.11 and 3.12 take the stack from the system in pieces of 16 kB. Where a loop's calls cross the end of one,
    each of them maps memory and unmaps it again, which can double the time of a compilation.
    """
    return call(*args, **kws)


_with_room.__code__ = _with_room.__code__.replace(co_stacksize=66_000)  # 8 bytes each; a power of two is taken


def _borrowed(typingctx, array):
    """Return the same array without its reference count, whose upkeep costs ten times what the kernel computes.

    Only for use within a call that holds the array itself.
    """

    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        return view._getvalue()

    return array(array), codegen


borrowed: Any = intrinsic(_borrowed)
