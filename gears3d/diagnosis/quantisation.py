"""Quantisation by coarse encoders: what is off in one record alone is no gear's then.

Where noise does not blur the counts, readings are off alike for as long as counts and samples keep pace: in a whole
record, if that is its speed, and in no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.cause import contribution
from gears3d.diagnosis.grounds import Note
from gears3d.diagnosis.prediction import CHANNELS, parts_of
from gears3d.diagnosis.remains import channel_of, farthest
from gears3d.diagnosis.search import ACCEPT

if TYPE_CHECKING:
    from gears3d.diagnosis.cause import Cause
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.structure import Structure

Array = np.ndarray
COARSE = 0.05
"""Count on the base circle, as a part of the backlash, from which on encoders are coarse: over twenty times that of
ordinary benches, less than half of that of 8192 counts (tests/diagnosis/test_quantisation.py)."""
REPEATED = "impact.time"
"""Structure that counts make in any record: they come back with the motion, and so do the errors of earlier blows."""


def quantum_of(one: Evidence) -> float:
    """Return a count of the coarser encoder on its base circle, as a part of the backlash; 0 without counts.

    Args:
        one: the record.
    """
    sensors = one.scenario.sensors
    counts = (sensors.drive.counts_per_revolution, sensors.loose.counts_per_revolution)
    steps = [2.0 * pi * radius / count for radius, count in zip(one.radii, counts, strict=True) if count]
    return max(steps, default=0.0) / one.rig.backlash


def are_coarse(records: Sequence[Evidence]) -> bool:
    """Return whether encoders are coarse in any of some records.

    Args:
        records: any.
    """
    return max(map(quantum_of, records)) > COARSE


def shared(
    records: Sequence[Evidence],
    rest: Array,
    left: Sequence[Structure],
    looked: Callable[[Sequence[Evidence], Array], Sequence[Structure]],
) -> tuple[list[Structure], list[Structure]]:
    """Return the structure that belongs to the gears, and what coarse encoders may have made.

    That is what is gone without the record that is farthest off, and rebounds that are like those before them.

    Args:
        records: all.
        rest: residuals that the causes leave, stacked, (n,).
        left: structure in all of them.
        looked: how it was found.
    """
    if not left or not are_coarse(records):
        return list(left), []
    kept: set[str] = set()
    for channel in {channel_of(one.name) for one in left}:
        others = _without_farthest(records, rest, channel)
        there = {one.name for one in (left if others is None else looked(*others)) if one.name != REPEATED}
        kept |= {one.name for one in left if channel_of(one.name) == channel and one.name in there}
    return [one for one in left if one.name in kept], [one for one in left if one.name not in kept]


def _without_farthest(
    records: Sequence[Evidence], rest: Array, channel: str
) -> tuple[Sequence[Evidence], Array] | None:
    """Return records and residuals without the record farthest off; ``None`` where no other has points there."""
    parts = parts_of(records, rest)
    worst = farthest(parts[channel])
    if not any(own.size for k, own in enumerate(parts[channel]) if k != worst):
        return None
    others = [one for k, one in enumerate(records) if k != worst]
    some = [own for name in CHANNELS for k, own in enumerate(parts[name]) if k != worst]
    return others, np.concatenate(some)


def alone(records: Sequence[Evidence], rest: Array, cause: Cause) -> Note | None:
    """Return that a cause rests on one of several records of coarse encoders alone; ``None`` where not.

    Args:
        records: all.
        rest: residuals that all causes leave, stacked, (n,).
        cause: one of them.
    """
    if cause.effect is None or len(records) < 2:
        return None
    own = contribution(records, [cause.effect])
    parts = parts_of(records, own * (own + 2.0 * rest))
    gains = np.array([sum(float(np.sum(parts[name][k])) for name in CHANNELS) for k in range(len(records))])
    if float(np.sum(gains) - np.max(gains)) >= ACCEPT:
        return None
    best = records[int(np.argmax(gains))].name
    return _note(records, f"the deviations that indicate {cause.candidate.kind} in this record only", best)


def of_counts(records: Sequence[Evidence], gone: Sequence[Structure]) -> list[Note]:
    """Return what was not told of the gears.

    Args:
        records: all.
        gone: structure that coarse encoders may have made.
    """
    names = sorted({one.name for one in gone})
    return [_note(records, f"the residual patterns {', '.join(names)}", "")] if names else []


def _note(records: Sequence[Evidence], what: str, record: str) -> Note:
    size = max(map(quantum_of, records))
    text = f"one count of the encoders is {100.0 * size:.2g} % of the backlash: quantisation may cause {what}"
    return Note("coarse-counts", text, "record at other speeds, or with finer encoders", record)
