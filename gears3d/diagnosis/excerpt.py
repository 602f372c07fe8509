"""A short excerpt of a record as measured, and as the rig and the extended rig continue from its start.

Deviations of a rig show best from a measured initial state: over a few periods the motion has no time to diverge by
chance. The excerpt lies in the middle of its record, independent of its content.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.windows import LONGEST, Begin, as_read, begin_of, followed, readings, with_effects, zero_of
from gears3d.errors import Fault, InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.diagnosis import Diagnosis
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Track
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

# Shown periods of the drive's slowest fluctuation, limited to the length of a window.
PERIODS = 3.0
# Standard deviations of a sample within which the measured gear is shown on a flank.
ON_FLANK = 4.0
# The same relative to the backlash.
ON_FLANK_SHARE = 5e-3


@dataclass(frozen=True, eq=False)
class Excerpt:
    """One motion three times, each with its displacement from the mean active flank.

    Args:
        name: of the record.
        measured: readings, averaged; with impacts if the record was segmented.
        base: the rig from the measured initial state, under the drive's measured motion.
        extended: the same with the causes.
        rig: scenario of the record's condition.
        extended_rig: the same with the causes.
        near: gaps within which each of the three is shown on a flank [m].
        riding: flank in contact at the start; ``None`` in flight.
    """

    name: str
    measured: Recording
    base: Recording
    extended: Recording
    rig: Scenario
    extended_rig: Scenario
    near: tuple[float, float, float]
    riding: int | None = None


def excerpt(found: Diagnosis, admitted: Sequence[Admitted]) -> Excerpt:
    """Return a stretch of the record with the largest gain by the causes, or of the first.

    Raises:
        InputError: no record determines the place of the loose gear, or the rigid model does not cover the rig.
        EngineError: the motion cannot be continued.
    """
    from gears3d.measured.segmentation import path_of

    one = _largest_gain(found, admitted)
    assert one.rig is not None
    known = path_of(one.recording, one.rig, one.file)
    seen, extended, zero = _extended(found, one, known)
    noise = known.noise
    begin = begin_of(known, seen, zero, one.rig, _begin_search(known, one.rig))
    span = _duration(one.rig, known, begin)
    measured, few = readings(known, seen, zero, (begin.time, begin.time + span), one.rig)
    seen_as = [followed(rig, extended, begin, zero, span, known) for rig in (one.rig, extended)]
    touching = max(ON_FLANK * max(noise / np.sqrt(few), known.slack), ON_FLANK_SHARE * one.rig.rig().backlash)
    near = (float(touching), seen_as[0][1], seen_as[1][1])
    return Excerpt(one.file, measured, seen_as[0][0], seen_as[1][0], one.rig, extended, near, begin.riding)


def _extended(found: Diagnosis, one: Admitted, known: Track) -> tuple[Evidence | None, Scenario, float]:
    """Return a record's evidence by angles as read, its extended rig, and the displacement on the flank."""
    assert one.rig is not None
    seen, tables = next((each for each in found.found.records if each.name == one.file), None), []
    if seen is None:
        tables = [cause.table for cause in found.causes]
    else:
        seen, tables = as_read(seen, found.causes)
    extended = with_effects(one.rig, tables)
    zero = _datum_of_law(known, found, one.file)
    return seen, extended, zero_of(known, seen, extended) if zero is None else zero


def _largest_gain(found: Diagnosis, admitted: Sequence[Admitted]) -> Admitted:
    """Return the record with the largest likelihood gain by the causes, or the first that was used."""
    used = {each.name for each in found.found.records}
    usable = [one for one in admitted if one.rig is not None and one.file in used] or list(admitted)
    if not usable:
        raise InputError(Fault("", "no record is given", "name at least one"))
    gains = [sum(each.likelihood for each in found.held if each.held[0].startswith(one.file)) for one in usable]
    return usable[int(np.argmax(gains))]


def _duration(rig: Scenario, known: Track, begin: Begin) -> float:
    frequencies = [one.frequency for one in rig.motion.harmonics if one.frequency > 0.0]
    wanted = min(PERIODS / min(frequencies), LONGEST) if frequencies else 0.5 * LONGEST
    return min(wanted, float(known.time[-1]) - begin.time)


def _datum_of_law(known: Track, found: Diagnosis, file: str) -> float | None:
    """Return the displacement on the active flank from complete contact episodes, if these were fitted [m]."""
    at = [k for k, one in enumerate(found.law.records) if one.name == file] if found.law is not None else []
    if found.law is None or not at:
        return None
    first = known.radii[1] * known.origin[1] - known.radii[0] * known.origin[0]
    return first + float(found.law.held.zeros[at[0]])


def _begin_search(known: Track, rig: Scenario) -> float:
    """Return the start time of the search for a stretch in the middle of a record [s]."""
    half = 0.5 * float(known.time[0] + known.time[-1])
    period = rig.period if rig.motion.harmonics else 0.25 * LONGEST
    return max(half - 0.5 * PERIODS * period, float(known.time[0]))
