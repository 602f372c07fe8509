"""How the kernel's inner functions are compiled: only to be called from compiled code, and cached with it."""

from typing import Any

from numba.core import cgutils
from numba.extending import intrinsic

from gears3d.kernels import njit

inner: Any = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy")  # type: ignore[call-overload]
"""Decorator of functions that only compiled code calls; leaving out their Python wrappers saves compile time.

Divisions are not checked one by one (a motion that is not finite ends the run). Products are never fused with sums: the
compiler would do so here and not there, and a kernel from the cache would differ from a fresh one in the last digit.
"""

tight: Any = njit(  # type: ignore[call-overload]
    no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy", forceinline=True
)
"""The same for what every step calls: written out where it stands, and what is not asked for is not computed."""


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
