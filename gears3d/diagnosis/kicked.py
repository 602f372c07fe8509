"""Teeth that repel the loose gear: contact ends at one place of a revolution far more often than elsewhere.

A tooth with a positive deviation larger than the drag can follow makes the loose gear leave whenever the tooth passes
through mesh. No contact is then detected on it, and neighbouring events are segmented wrongly; but the place of the
contact losses, revolution after revolution, identifies the tooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log, pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import GEARS, NEGLIGIBLE, SIDES, Gear, influence
from gears3d.diagnosis.structure import Structure

Array = np.ndarray
# Probability, anywhere in the search, below which a number of contact ends at one place is significant.
CHANCE = 1e-6
# Smallest reported probability, as the chi-square with 2 degrees of freedom.
LEAST = 1e-300
# Bins per pitch; a window has as many.
PARTS = 2
# Minimum distance in pitches of a second place with as many ends: an order of the gear has several places.
AWAY = 3
# Displacement of the other gear, relative to the thickness of a tooth, at which the contact loss begins.
BEGINS = 0.02


def thrown(records: Sequence[Evidence], causes: Sequence[Any]) -> list[Structure]:
    """Return the unexplained tooth-synchronous contact loss if no pitch error is among the causes.

    At most one structure: its size is the fraction of the contacts that end there, its place the tooth.
    """
    if any(cause.candidate.kind == "pitch_error" for cause in causes):
        return []
    if (peak := _sharpest(records)) is None:
        return []
    gain, tooth = -2.0 * log(max(peak.chance, LEAST)), float(_tooth(records[0], peak))
    return [Structure(f"contact.tooth_{peak.gear}", gain, peak.chance, peak.share, "1", tooth, gain)]


class _Peak(NamedTuple):
    """Place at which most contacts of a flank end: probability, place in pitches, and fraction of all ends."""

    chance: float
    place: float
    gear: Gear
    flank: int
    share: float


def _tooth(one: Evidence, peak: _Peak) -> int:
    """Return the tooth whose contact loss begins where contact ends."""
    at, moved = influence(one.pair, peak.gear, SIDES[peak.flank], NEGLIGIBLE)
    there = at[np.abs(moved) > BEGINS * NEGLIGIBLE]
    return round(peak.place - float(there[0]) / (2.0 * pi)) % one.pair.gear(peak.gear).teeth + 1


def _sharpest(records: Sequence[Evidence]) -> _Peak | None:
    """Return the place of contact ends of least probability; ``None`` if no place is significant."""
    found = [each for gear in GEARS for flank in (0, 1) if (each := _peak(records, gear, flank)) is not None]
    best = min(found, default=None)
    return best if best is not None and best.chance * len(found) < CHANCE else None


def _peak(records: Sequence[Evidence], gear: Gear, flank: int) -> _Peak | None:
    """Return the place at which most contacts of a flank end; ``None`` with too few of them."""
    from scipy.stats import binom

    teeth = records[0].pair.gear(gear).teeth
    partings = [one.channels.contact_ends for one in records]
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
