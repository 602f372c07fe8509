"""Orders of both gears: their names, and which of them a record can tell apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identify.contact import HARMONICS, Contact

GEARS = ("drive", "loose")
APART = 0.7
"""Cycles over the record by which orders of both gears differ at least to be told apart."""


class Line(NamedTuple):
    """An order: cycles a turn of a gear.

    Args:
        gear: 0 drive, 1 loose.
        order: cycles a turn.
    """

    gear: int
    order: int

    @property
    def name(self) -> str:
        """As parameters are called: ``drive_1``."""
        return f"{GEARS[self.gear]}_{self.order}"


class Lines(NamedTuple):
    """The orders that are looked at.

    Args:
        all: those that can be told apart; one of each set of those that cannot, the drive's.
        frequency: of each, cycles a turn of the drive, (m,).
        alike: to each of the drive's, the loose gear's that it cannot be told from.
    """

    all: tuple[Line, ...]
    frequency: np.ndarray
    alike: dict[Line, Line]


def lines_of(contact: Contact, teeth: tuple[int, int]) -> Lines:
    """Return the orders that can be looked at in a record.

    Args:
        contact: with one flank.
        teeth: of drive and loose gear.
    """
    turns = np.ptp(contact.turn % 1_000_000) + 1.0 if contact.turns < 1.0 else contact.turns
    ratio = teeth[0] / teeth[1]
    highest = min(HARMONICS * teeth[0] + 2, int(0.8 * np.pi / contact.width))
    chosen = [Line(0, order) for order in range(1, highest + 1)]
    alike: dict[Line, Line] = {}
    for order in range(1, int(highest / ratio) + 1):
        nearest = round(order * ratio)
        if abs(order * ratio - nearest) < APART / turns and 1 <= nearest <= highest:
            alike.setdefault(Line(0, nearest), Line(1, order))
        else:
            chosen.append(Line(1, order))
    frequency = np.array([line.order * (ratio if line.gear else 1.0) for line in chosen])
    keep = frequency * turns > APART
    return Lines(tuple(line for line, k in zip(chosen, keep, strict=True) if k), frequency[keep], alike)
