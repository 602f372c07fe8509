"""Teeth that kick: contact that ends at one place of a gear's turn far more often than anywhere else.

A tooth that stands out by more than the drag can follow throws the loose gear off whenever it comes by. No contact is
seen on it then, and what happens beside it is cut wrongly; but where it throws, turn after turn, tells which it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log, pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.deviation import BENT, Gear, influence
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.struck import GEARS, SIDES
from gears3d.diagnosis.structure import Structure

Array = np.ndarray
CHANCE = 1e-6
"""Probability, anywhere in the search, below which so many ends of contact at one place are no chance."""
LEAST = 1e-300
"""Chance that is told at least, as the chi-square of two freedoms that comes by it."""
PARTS = 2
"""Bins to a pitch; a window has as many."""
AWAY = 3
"""Pitches from a place to where as many may end: an order of the gear throws at more places than one."""
BEGINS = 0.02
"""Part of a tooth's thickness by which it moves the other gear where it begins to throw it."""


def thrown(records: Sequence[Evidence], causes: Sequence[Any]) -> list[Structure]:
    """Return what a tooth that kicks leaves unexplained where no pitch error is among the causes.

    Args:
        records: all.
        causes: that were found.

    Returns:
        One structure at most: its size is the part of the contacts that end there, its place the tooth.
    """
    if any(cause.candidate.kind == "pitch_error" for cause in causes):
        return []
    if (peak := _sharpest(records)) is None:
        return []
    gain, tooth = -2.0 * log(max(peak.chance, LEAST)), float(_tooth(records[0], peak))
    return [Structure(f"contact.tooth_{peak.gear}", gain, peak.chance, peak.share, "1", tooth, gain)]


class _Peak(NamedTuple):
    """Where most contacts of a flank end: by what chance, place in pitches, and their part of all."""

    chance: float
    place: float
    gear: Gear
    flank: int
    share: float


def _tooth(one: Evidence, peak: _Peak) -> int:
    """Return the tooth that begins to throw at the place where contact ends."""
    at, moved = influence(one.pair, peak.gear, SIDES[peak.flank], BENT)
    there = at[np.abs(moved) > BEGINS * BENT]
    return round(peak.place - float(there[0]) / (2.0 * pi)) % one.pair.gear(peak.gear).teeth + 1


def _sharpest(records: Sequence[Evidence]) -> _Peak | None:
    """Return the place at which contact ends by the least chance, ``None`` where it may end so anywhere."""
    found = [each for gear in GEARS for flank in (0, 1) if (each := _peak(records, gear, flank)) is not None]
    best = min(found, default=None)
    return best if best is not None and best.chance * len(found) < CHANCE else None


def _peak(records: Sequence[Evidence], gear: Gear, flank: int) -> _Peak | None:
    """Return where most contacts of a flank end; ``None`` where too few of them do."""
    from scipy.stats import binom

    teeth = records[0].pair.gear(gear).teeth
    partings = [one.channels.partings for one in records]
    places = [np.mod(getattr(each, gear)[each.flank == flank] * teeth / (2.0 * pi), teeth) for each in partings]
    counts = np.array([np.bincount((own * PARTS).astype(int) % (PARTS * teeth), minlength=PARTS * teeth)
                       for own in places])  # fmt: skip
    windows = np.sum([np.roll(counts, -k, axis=1) for k in range(PARTS)], axis=0)
    total, most = windows.sum(axis=0), windows.max(axis=0)
    sizes = np.array([len(own) for own in places])
    others = total - most if len(records) > 1 else total
    left = sizes.sum() - sizes[np.argmax(windows, axis=0)] if len(records) > 1 else np.full(len(total), sizes.sum())
    here = np.arange(len(total))
    apart = np.minimum(np.mod(here[:, None] - here, len(total)), np.mod(here - here[:, None], len(total)))
    elsewhere = np.where(apart >= AWAY * PARTS, others / np.maximum(left, 1), 0.0).max(axis=1)
    usual = np.clip(np.maximum(1.0 / teeth, elsewhere), 0.0, 1.0)
    chances = binom.sf(others - 1, left, usual) * PARTS * teeth
    best = int(np.argmin(chances))
    away = np.mod(np.concatenate(places) - best / PARTS, teeth)
    if not (ends := away[away < 1.0]).size:
        return None
    return _Peak(float(chances[best]), best / PARTS + float(np.median(ends)), gear, flank, ends.size / away.size)
