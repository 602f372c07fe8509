"""Compilation of the rigid model's kernels.

Divisions are not checked one by one (a motion that is not finite ends the run). Products are never fused with sums: the
compiler would fuse some and not others, and a kernel from the cache would differ from a fresh one in the last digit.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from numba.core import cgutils
from numba.extending import intrinsic

from gears3d import kernels

# For functions that only compiled code calls. They make no arrays, so references to those that they get are not
# counted, which would cost more than the computation.
inner: Any = partial(kernels.inner, error_model="numpy", _nrt=False)
# for functions that only compiled code calls and that make arrays
owner: Any = partial(kernels.inner, error_model="numpy", _nrt=True)
# For functions that every step calls: inlined, so that unused results are not computed.
tight: Any = partial(kernels.inner, error_model="numpy", forceinline=True, _nrt=False)
# For functions that Python calls; kept on disk and run without Python's lock.
entry: Any = kernels.njit(cache=True, nogil=True, error_model="numpy")


def _borrowed(typingctx, array):
    """Return the same array without its reference count, which would cost ten times the kernel's computation.

    Only for use within a call that holds the array itself.
    """

    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        return view._getvalue()

    return array(array), codegen


borrowed: Any = intrinsic(_borrowed)
