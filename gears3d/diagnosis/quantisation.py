"""Quantisation by coarse encoders: a residual in one record alone is then not attributed to the gears.

Without noise that dithers the counts, the reading errors repeat while the count rate is commensurate with the sampling
rate: in a complete record at such a speed, and in no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.candidates import ACCEPT
from gears3d.diagnosis.cause import contribution
from gears3d.diagnosis.grounds import Note
from gears3d.diagnosis.prediction import CHANNELS, parts_of
from gears3d.diagnosis.remains import channel_of, farthest

if TYPE_CHECKING:
    from gears3d.diagnosis.cause import Cause
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.structure import Structure

Array = np.ndarray
# Count on the base circle, relative to the backlash, above which encoders are coarse: over 20 times that of ordinary
# test rigs, less than half of that of 8192 counts (tests/diagnosis/test_quantisation.py).
COARSE = 0.05
# Residual pattern of counts in any record: they repeat with the motion, and so do the errors of earlier impacts.
REPEATED = "impact.time"


def quantum_of(one: Evidence) -> float:
    """Return a count of the coarser encoder on its base circle, relative to the backlash; 0 without counts."""
    sensors = one.scenario.sensors
    counts = (sensors.drive.counts_per_revolution, sensors.loose.counts_per_revolution)
    steps = [2.0 * pi * radius / count for radius, count in zip(one.radii, counts, strict=True) if count]
    return max(steps, default=0.0) / one.rig.backlash


def are_coarse(records: Sequence[Evidence]) -> bool:
    """Return whether encoders are coarse in any of some records."""
    return max(map(quantum_of, records)) > COARSE


def shared(
    records: Sequence[Evidence],
    rest: Array,
    left: Sequence[Structure],
    looked: Callable[[Sequence[Evidence], Array], Sequence[Structure]],
) -> tuple[list[Structure], list[Structure]]:
    """Return the residual patterns of the gears, and those that coarse encoders may cause.

    The latter vanish without the record of largest residuals, or are correlations of rebounds with earlier ones; rest:
    (n,).
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
    """Return data without the record of largest residuals; ``None`` if no other has points in the channel."""
    parts = parts_of(records, rest)
    worst = farthest(parts[channel])
    if not any(own.size for k, own in enumerate(parts[channel]) if k != worst):
        return None
    others = [one for k, one in enumerate(records) if k != worst]
    some = [own for name in CHANNELS for k, own in enumerate(parts[name]) if k != worst]
    return others, np.concatenate(some)


def alone(records: Sequence[Evidence], rest: Array, cause: Cause) -> Note | None:
    """Return a note if a cause depends on one of several records of coarse encoders alone, else ``None``.

    rest: (n,).
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
    """Return notes on the residual patterns that are not attributed to the gears."""
    names = sorted({one.name for one in gone})
    return [_note(records, f"the residual patterns {', '.join(names)}", "")] if names else []


def _note(records: Sequence[Evidence], what: str, record: str) -> Note:
    size = max(map(quantum_of, records))
    text = f"one count of the encoders is {100.0 * size:.2g} % of the backlash: quantisation may cause {what}"
    return Note("coarse-counts", text, "record at other speeds, or with finer encoders", record)
