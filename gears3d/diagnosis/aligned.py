"""The search for causes in records with unknown angular datums: align, search, re-align by the causes found."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from gears3d.diagnosis.candidates import Candidate
from gears3d.diagnosis.cause import Cause, contribution
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.joint import settled
from gears3d.diagnosis.library import Library
from gears3d.diagnosis.prediction import GEARS
from gears3d.diagnosis.restitution_scatter import with_own_noise
from gears3d.diagnosis.search import Search, known_of, search
from gears3d.diagnosis.sifting import without_strays
from gears3d.diagnosis.tooth_zeros import tooth
from gears3d.diagnosis.zeros import (
    Phases,
    apart,
    free,
    goes_by,
    order_of,
    reference,
    turn,
    turns,
)

Array = np.ndarray
TOOTH = "pitch_error"
# Chi-square threshold of a single tooth, beyond that of its free places, to fix the angular datums.
LEAST = 60.0
# Maximum number of joint fits of datums and causes, and the change of chi-square that ends them.
SETTLED, ENOUGH = 2, 1.0
# Maximum number of rounds of alignment and search.
ROUNDS = 3


def aligned(records: list[Evidence], highest: int, first: Sequence[Cause] = ()) -> tuple[list[Evidence], Search]:
    """Return the records with angles counted from the datum of one of them, and the result of a search there.

    Each gear is aligned by the strongest candidate that depends on its angle. In the first round it is taken from the
    records as they are; in later rounds the effects of the other causes are removed before.
    """
    gears = [gear for gear in GEARS if free(records, gear)]
    if not gears:
        return records, search(records, highest, first)
    base, known = known_of(with_own_noise([without_strays(one) for one in records]), highest)
    told = {gear: _told(known, base, gear) for gear in gears}
    found = None
    for _ in range(ROUNDS):
        by = {gear: _by(records, gear, told.get(gear)) for gear in GEARS}
        if found is not None and not any(one is not None and apart(one[1], by[gear]) for gear, one in told.items()):
            break
        records = [turn(*each) for each in zip(records, by["drive"], by["loose"], strict=True)]
        found = search(records, highest, first)
        told = {gear: _anew(found, gear) for gear in gears}
    assert found is not None
    for _ in range(SETTLED):
        by, changed = settled(found.records, found.fit.causes)
        if changed < ENOUGH:
            break
        records = [turn(one, *pair) for one, pair in zip(records, by, strict=True)]
        found = search(records, highest, first)
    return records, found


def _told(known: Library, rest: Array, gear: str) -> tuple[Array, Phases] | None:
    """Return the datum shifts of records from the candidate of largest gain with an order, or from a single tooth."""
    told, single = turns(known, rest, gear), tooth(known, rest, gear)
    lost = np.array([gear in one.unmarked for one in known.records])
    if not np.all(lost) or single.gain < (told[1].gain if told is not None else LEAST):
        return told
    one = Candidate(TOOTH, {"gear": gear}, "offset", 1.0, False, ("contact",))
    return single.turns, Phases(one, single.gain, single.place, single.worth * single.teeth**2)


def _by(records: Sequence[Evidence], gear: str, told: tuple[Array, Phases] | None) -> Array:
    """Return the datum shifts of records; a record that shows the candidate clearly keeps its datum."""
    if told is None:
        return np.zeros(len(records))
    by, seen = told
    if seen.candidate.kind == TOOTH or not all(gear in one.unmarked for one in records):
        return by
    first, side = reference(seen.worth), GEARS.index(gear)
    return by - (records[first].turned[side] + by[first])


def _anew(found: Search, gear: str) -> tuple[Array, Phases] | None:
    """Return the remaining datum shifts of records, from the residuals without the causes of other angles."""
    own = [cause for cause in found.fit.causes if goes_by(cause.candidate) == gear]
    effects = [cause.effect for cause in own if cause.effect is not None]
    parts = contribution(found.records, effects)
    told = _told(found.known, found.fit.rest + parts, gear)
    if told is None or told[1].candidate.kind == TOOTH or order_of(told[1].candidate) == 1 or apart(told[1], told[0]):
        return told
    strongest = [one for one in effects if getattr(one, "order", 1) == order_of(told[1].candidate)]
    rest = found.fit.rest + parts - contribution(found.records, strongest)
    return _branched(told, turns(found.known, rest, gear, [order_of(told[1].candidate)]))


def _branched(told: tuple[Array, Phases], other: tuple[Array, Phases] | None) -> tuple[Array, Phases]:
    """Return shifts by whole periods of the strongest order, selected by another order."""
    if other is None:
        return told
    period, own = 2.0 * pi / order_of(told[1].candidate), 2.0 * pi / order_of(other[1].candidate)
    tried = period * np.arange(order_of(told[1].candidate))
    off = np.abs((tried[None] - other[0][:, None] + own / 2.0) % own - own / 2.0)
    best = tried[np.argmin(off, axis=1)]
    return np.where(other[0] == 0.0, 0.0, best), other[1]
