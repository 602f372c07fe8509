"""How the kernel's inner functions are compiled: only to be called from compiled code, and cached with it."""

from numba import njit

inner = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""Decorator of functions that only compiled code calls; leaving out their Python wrappers saves compile time."""
