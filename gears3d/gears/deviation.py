"""Deviations of flanks from the perfect involute, as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gears3d.errors import Fault, InputError, did_you_mean

GEARS = ("drive", "loose")
FLANKS = ("active", "reverse")


def index_of(word: str, words: tuple[str, ...], key: str) -> int:
    """Return the place of a word among the known words.

    Args:
        word: what was given.
        words: what is allowed.
        key: the name of the argument, for the message.

    Returns:
        0 or 1.

    Raises:
        InputError: the word is not known.

    >>> index_of("loose", GEARS, "gear")
    1
    """
    if word not in words:
        raise InputError(Fault(key, f"is {word!r}", did_you_mean(str(word), words)))
    return words.index(word)


@dataclass(frozen=True)
class HarmonicDeviation:
    """Material amplitude·cos(order·θ + phase) along the outward normal, θ the gear's own angle when it touches.

    The flank is shaped so that against a perfect mate it touches displaced by exactly this amount along the
    transverse line of action.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        order: whole cycles per revolution of the gear.
        amplitude: [m].
        phase: [rad].

    Raises:
        InputError: unknown words, or an order that does not close after a revolution.

    >>> HarmonicDeviation("drive", "active", 90, 5e-6).phase
    0.0
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    order: int
    amplitude: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        index_of(self.gear, GEARS, "gear")
        index_of(self.flank, FLANKS, "flank")
        if self.order < 0 or self.order != int(self.order):
            raise InputError(Fault("order", f"is {self.order:g}", "a flank closes after a turn: give a whole number"))


@dataclass(frozen=True)
class ToothDeviation:
    """Material of constant thickness on one flank of one tooth.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        tooth: number of the tooth in order of meshing, 1 = at the pitch point when the gear's angle is 0.
        offset: thickness along the outward normal [m].

    Raises:
        InputError: unknown words.

    >>> ToothDeviation("loose", "reverse", 12, 20e-6).tooth
    12
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    tooth: int
    offset: float

    def __post_init__(self) -> None:
        index_of(self.gear, GEARS, "gear")
        index_of(self.flank, FLANKS, "flank")


Deviation = HarmonicDeviation | ToothDeviation
