"""Errors that stop a run: each states when, how much, and what to do."""

from __future__ import annotations

import math

from gears3d.errors import EngineError

SUNK = 1e-7  # largest overlap of the flanks of rigid teeth [m]
SUNK_NATIVE = 2e-5  # the same in Bullet's own contact, whose quantised hulls deviate by 10 % of it [m]
YIELDED = 0.1  # the same for compliant flanks, in modules: beyond it neighbouring teeth would carry load, too


def jammed_at_start(overlap: float) -> EngineError:
    """Return the error of flanks that overlap [m], both together, before anything moves."""
    return EngineError(
        f"the gears are jammed at the start: their flanks overlap by {1e6 * overlap:.3g} µm"
        " (give more backlash or a larger centre distance)"
    )


def jammed(time: float) -> EngineError:
    """Return the error of gears of which both flanks touch at a time [s]."""
    return EngineError(f"the gears jam at t = {time:.6g} s: both flanks of the loose gear touch (give more backlash)")


def sunk(depth: float, time: float, remedy: str) -> EngineError:
    """Return the error of teeth that overlap by ``depth`` [m] at a time [s].

    >>> print(sunk(3e-6, 0.25, "give stiffer teeth"))
    the teeth lie 3 µm deep in each other at t = 0.25 s: the contact is too soft (give stiffer teeth)
    """
    return EngineError(
        f"the teeth lie {depth * 1e6:.3g} µm deep in each other at t = {time:.6g} s: the contact is too soft ({remedy})"
    )


def not_closed(gap: float, time: float) -> EngineError:
    """Return the error of an impact of flanks that do not touch, at a gap [m] and time [s]."""
    return EngineError(f"the gap is {gap * 1e9:.3g} nm at the impact at t = {time:.9g} s")


def standing(time: float) -> EngineError:
    """Return the error of events without progress in time [s]."""
    return EngineError(f"no progress at t = {time:.9g} s: raise impact.stick_velocity")


def not_a_number(time: float) -> EngineError:
    """Return the error of a state that is not a number after ``time`` [s]."""
    return EngineError(f"the loose gear's state is not a number after t = {time:.6g} s: look at the torques")


def see_numbers(theta: float, omega: float, time: float) -> None:
    """Raise an EngineError for an angle or speed that is not finite after ``time`` [s], before it is written."""
    if not (math.isfinite(theta) and math.isfinite(omega)):
        raise not_a_number(time)
