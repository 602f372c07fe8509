"""Roots by Chandrupatla's method: inverse quadratic interpolation in a bracket, halved where that would not be safe.

Source: T. R. Chandrupatla 1997, Advances in Engineering Software 28, 145-149.
"""

from __future__ import annotations

from typing import NamedTuple

from gears3d.engine.compile import inner

ROUNDING = 1.2e-16  # relative resolution of times
FINEST = 1e-18  # s


class Bracket(NamedTuple):
    """Two times between which a function of time changes its sign, and the time tried before.

    Args:
        at: the newest time [s].
        value: the function there.
        other: the time on the other side of the root [s].
        value_other: of the other sign.
        before: the time that one of them has replaced [s].
        value_before: the function there.
    """

    at: float
    value: float
    other: float
    value_other: float
    before: float
    value_before: float


@inner
def first_bracket(low: float, value_low: float, high: float, value_high: float) -> Bracket:
    """Return the bracket of two times [s]."""
    return Bracket(high, value_high, low, value_low, low, value_low)


@inner
def wider(bracket: Bracket, since: float) -> bool:
    """Return whether a bracket, of times after ``since`` [s], is wider than rounding, with the root inside."""
    if (bracket.value_other < 0.0) == (bracket.value < 0.0):
        return False
    return abs(bracket.other - bracket.at) > 2.0 * (FINEST + ROUNDING * since)


@inner
def proposed(bracket: Bracket, since: float) -> float:
    """Return the next time to be tried [s]."""
    a, fa, b, fb, c, fc = bracket
    part = 0.5
    if c != b and fc != fb and fc != fa:
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    least = (FINEST + ROUNDING * since) / abs(b - a)
    return a + min(max(part, least), 1.0 - least) * (b - a)


@inner
def narrowed(bracket: Bracket, at: float, value: float) -> Bracket:
    """Return the bracket after a trial."""
    if (value < 0.0) == (bracket.value < 0.0):
        return Bracket(at, value, bracket.other, bracket.value_other, bracket.at, bracket.value)
    return Bracket(at, value, bracket.at, bracket.value, bracket.other, bracket.value_other)


@inner
def below(bracket: Bracket) -> float:
    """Return the end of a bracket at which the function is negative [s]."""
    return bracket.at if bracket.value < 0.0 else bracket.other


@inner
def above(bracket: Bracket) -> float:
    """Return the end of a bracket at which the function is not negative [s]."""
    return bracket.other if bracket.value < 0.0 else bracket.at
