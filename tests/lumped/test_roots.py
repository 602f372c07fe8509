"""The first root of a polynomial, against numpy's companion matrix and by construction."""

from math import inf

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from gears3d.lumped.roots import first_root, highest


@njit
def root_of(c, sign, n, reach):
    return first_root(c, sign, n, reach)


@njit
def highest_of(c, n, reach):
    return highest(c, n, reach)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.floats(0.05, 3.0), min_size=1, max_size=6), st.booleans())
def test_finds_the_first_of_many(roots, upside_down):
    c = np.polynomial.polynomial.polyfromroots(roots)
    c *= np.sign(c[0])
    sign = 1.0
    if upside_down:
        c, sign = -c, -1.0
    ordered = sorted(roots)
    first = ordered[0]
    if any(abs(first - other) < 0.02 for other in ordered[1:]):
        return  # a touch, not a crossing
    got = root_of(c, sign, len(c) - 1, 10.0)
    slope = abs(np.polynomial.polynomial.polyval(first, np.polynomial.polynomial.polyder(c)))
    assert abs(got - first) < 1e-13 * np.abs(c * first ** np.arange(len(c))).sum() / slope + 1e-14
    assert root_of(c, sign, len(c) - 1, 0.99 * first) == inf


def test_a_start_on_the_axis_is_no_root():
    c = np.array([0.0, 1e-9, -0.25, 3.0, 0.0])
    assert abs(root_of(c, 1.0, 4, 1.0) / 4e-9 - 1) < 1e-6
    assert root_of(np.array([0.0, 0.0, 0.0, 2.0, -1.0]), 1.0, 4, 10.0) == 2.0


def test_falling_at_once_and_never_falling():
    assert root_of(np.array([0.0, -1.0, 5.0]), 1.0, 2, 1.0) == 0.0
    assert root_of(np.array([-1e-18, 1.0, 5.0]), 1.0, 2, 1.0) == 0.0
    assert root_of(np.zeros(4), 1.0, 3, 1.0) == inf
    assert root_of(np.array([1.0, -2.0, 1.0 + 1e-12]), 1.0, 2, 5.0) == inf


def test_a_dip_that_just_misses_is_no_root_and_one_that_just_cuts_is():
    for lift, found in ((1e-13, False), (-1e-13, True)):
        c = np.polynomial.polynomial.polymul([1 + lift, -2.0, 1.0], [1.0, 0.3, 0.1])
        got = root_of(c, 1.0, 4, 5.0)
        assert (got < inf) == found
        assert not found or abs(got - 1) < 1e-6


def test_highest_point_of_a_flight():
    c = np.array([0.0, 2.0, -1.0, 0.01, 0.0])
    top = (2 - (4 - 0.24) ** 0.5) / 0.06  # root of 2 - 2x + 0.03x²
    assert abs(highest_of(c, 4, 2.0) - np.polynomial.polynomial.polyval(top, c)) < 1e-14
    assert highest_of(c, 4, 0.5) == np.polynomial.polynomial.polyval(0.5, c)
