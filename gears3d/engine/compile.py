"""Compilation of the engine's kernels.

Divisions are not checked one by one: a state that is not a number ends the run.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from gears3d import kernels

inner: Any = partial(kernels.inner, error_model="numpy")  # for functions that only compiled code calls
entry: Any = kernels.njit(cache=True, error_model="numpy")  # for functions that Python calls; kept on disk
