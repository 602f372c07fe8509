"""A record segmented with known flanks: runs in the dead band, flights among them, and their touches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.flights import Shafts, Touches, leave, meet, shafts
from gears3d.measured.segmentation.kinks import Kinks
from gears3d.measured.segmentation.parabolas import FEWEST, SURE, Parabolas, common_law, fit, slope_within, tied
from gears3d.measured.segmentation.smoothing import Blocks, Track
from gears3d.measured.segmentation.tables import Segments, contacts_between, flight_table, impacts_of
from gears3d.measured.segmentation.zones import (
    ACTIVE,
    CUT,
    REVERSE,
    Runs,
    clearance,
    readings_of,
    runs,
    touches_missed,
    zones,
)

# Deviations by which the speed of an approach must differ from rest; a bump of the flank has none.
BLOW = 5.0
# Reasons why a stretch above a flank is not a flight: too few readings, no speed at its end, end of the record.
DROPPED = ("too_short", "no_blow", "cut_off")
# Deviations within which the end of a flight and the start of the next are one touch.
SAME = 4.0
# Longest impact of compliant teeth [s]; longer episodes are sustained contact.
HELD = 5e-3
# Separation speed over approach speed, at least, after contact of that duration.
THROWN = 0.15
# Multiple of the clearance of flight that noise on a flank does not reach.
RISEN = 2.0
# Median chi-square of flights from which the flanks are rejected.
WRONG = 5.0


class Cut(NamedTuple):
    """A record segmented with given flanks, and the inputs of the segmentation.

    Args:
        segments: the record.
        paths: parabolas of its flights.
        where: both shafts and the flanks.
    """

    segments: Segments
    paths: Parabolas
    where: Shafts


def cut_along(known: Track, path: Blocks, flanks: Flanks, seeds: Kinks, file: str) -> Cut:
    """Segment a record with given flanks.

    Raises InputError when the noise fills the dead band.
    """
    zone, above, below = zones(path, flanks, seeds, file)
    every, first, last, dropped, edges, short = _candidates(known, path, zone, above, below)
    rough = fit(known, first, last)
    if len(wrong := np.flatnonzero(rough.chi2 > WRONG)):
        zone = touches_missed(zone, above, below, every, wrong, clearance(path, flanks))
        every, first, last, dropped, edges, short = _candidates(known, path, zone, above, below)
        rough = fit(known, first, last)
    where = shafts(known, path, flanks)
    start, end = _touches(known, path, every, tied(known, first, last, rough, common_law(rough)), where)
    first, last = _between(known, start, end, first, last)
    free = fit(known, first, last)
    slope = slope_within(known, first, last, free)
    curved = slope[0] if abs(slope[0]) > SURE * slope[1] else 0.0
    free = fit(known, first, last, curved) if curved else free
    bound = tied(known, first, last, free, common_law(free))
    start, end = _touches(known, path, every, bound, where)
    flew = _struck(every, start, end) | (every.height > RISEN * clearance(path, flanks))
    low = every.height[~flew]
    every, free, bound, start, end = _only(flew, every, free, bound, start, end)
    start, end = _met_once_more(known, path, every, bound, where, start, end)
    real = _struck(every, start, end)
    dropped["no_blow"] = len(flew) - int(np.count_nonzero(real))
    missed = np.concatenate([short, low, every.height[~real]])
    every, free, bound, start, end = _only(real, every, free, bound, start, end)
    same = _one_touch(known, every, start, end)
    start = _tangents(bound, where, every, start, end, same)
    start, end = start.moving(where, every.left, path.width), end.moving(where, every.struck, path.width)
    flights = flight_table(every, free, start, end, same)
    contacts, impacts = contacts_between(flights, edges), impacts_of(flights, same, known.step)
    found = Segments(known, path, flanks, flights, contacts, impacts, dropped, slope, missed)
    return Cut(found, bound, where)


def _candidates(
    known: Track, path: Blocks, zone: np.ndarray, above: np.ndarray, below: np.ndarray
) -> tuple[Runs, np.ndarray, np.ndarray, dict[str, int], tuple[float, float, int], np.ndarray]:
    """Return runs that may be flights, their first and last readings, what was dropped, and what is known in all.

    Last come the heights of those that are too short.
    """
    every = runs(zone, above, below)
    first, last = readings_of(every, path.size, len(known.time))
    enough = last - first + 1 >= FEWEST
    whole = (every.left != CUT) & (every.struck != CUT)
    dropped: dict[str, int] = dict.fromkeys(DROPPED, 0)
    dropped["too_short"] = int(np.count_nonzero(~enough & whole))
    dropped["cut_off"] = int(np.count_nonzero(~whole))
    keep = enough & whole
    edges = _ends_beyond(known, path, every, whole)
    return (
        Runs(*(column[keep] for column in every)),
        first[keep],
        last[keep],
        dropped,
        edges,
        every.height[~enough & whole],
    )


def _ends_beyond(known: Track, path: Blocks, every: Runs, whole: np.ndarray) -> tuple[float, float, int]:
    """Return where what is known begins and ends, flights that are cut off left out, and the flank it begins on."""
    begin, end = float(known.time[0]), float(known.time[-1])
    if len(whole) and not whole[0] and every.left[0] == CUT:
        begin = float(path.time[every.last[0]])
    if len(whole) and not whole[-1] and every.struck[-1] == CUT:
        end = float(path.time[every.first[-1]])
    flank = ACTIVE
    if len(whole):
        flank = int(every.left[0]) if every.left[0] != CUT else int(max(every.struck[0], 0))
    return begin, end, flank


def _touches(
    known: Track, path: Blocks, every: Runs, paths: Parabolas, where: Shafts, some: np.ndarray | None = None
) -> tuple[Touches, Touches]:
    """Return where flights begin and end, as if all began with an impact; of some of them only if these are given."""
    size = path.size
    inner = known.time[every.first * size], known.time[np.minimum((every.last + 1) * size, len(known.time)) - 1]
    lasted = inner[1] - inner[0]
    reach = np.maximum(0.5 * lasted, 6.0 * path.width)
    after = np.append(inner[0][1:], known.time[-1]) + path.width  # a touch shows to within a block
    before = np.insert(inner[1][:-1], 0, known.time[0]) - path.width
    inside = 0.4 * lasted
    late = np.maximum(np.minimum(reach, after - inner[1]), path.width)
    early = np.maximum(np.minimum(reach, inner[0] - before), path.width)
    some = np.arange(len(lasted)) if some is None else some
    paths = paths.some(some)
    end = meet(paths, where, every.struck[some], (inner[1] - inside)[some], (late + inside)[some])
    start = meet(paths, where, every.left[some], (inner[0] + inside)[some], -(early + inside)[some])
    return start, end


def _struck(every: Runs, start: Touches, end: Touches) -> np.ndarray:
    """Return whether each run ends with an impact on a flank, (k,).

    A run that crosses the dead band cannot end otherwise, even where noise hides the speed; one that returns to its
    flank may be a bump.
    """
    fast = end.met & (np.abs(end.velocity) > BLOW * end.velocity_sigma)
    return (fast | (end.near & (every.left != every.struck))) & (end.time > start.time)


def _only(
    kept: np.ndarray, every: Runs, free: Parabolas, bound: Parabolas, start: Touches, end: Touches
) -> tuple[Runs, Parabolas, Parabolas, Touches, Touches]:
    """Return the runs that are kept, with their parabolas and touches."""
    first, last = (Touches(*(column[kept] for column in one)) for one in (start, end))
    return Runs(*(column[kept] for column in every)), free.some(kept), bound.some(kept), first, last


def _met_once_more(
    known: Track, path: Blocks, every: Runs, paths: Parabolas, where: Shafts, start: Touches, end: Touches
) -> tuple[Touches, Touches]:
    """Return where flights begin and end; those without a flank at an end are re-examined.

    A path that rises slowly from its flank passes what counts as flying several times in its noise. The short runs that
    this makes stood between the flight and its touch, as long as they counted as flights themselves.
    """
    missed = np.flatnonzero(~(start.met & end.met))
    if not len(missed):
        return start, end
    begun, ended = _touches(known, path, every, paths, where, missed)

    def mended(before: Touches, now: Touches) -> Touches:
        keep = before.met[missed] | ~now.met
        columns = [column.copy() for column in before]
        for column, new in zip(columns, now, strict=True):
            column[missed] = np.where(keep, column[missed], new)
        return Touches(*columns)

    return mended(start, begun), mended(end, ended)


def _between(
    known: Track, start: Touches, end: Touches, first: np.ndarray, last: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the readings that surely lie between the touches; those of before where there are too few."""
    spacing = known.spacing
    lasted = np.maximum(end.time - start.time, 0.0)
    after = start.time + np.minimum(SAME * start.sigma, 0.25 * lasted) + spacing
    before = end.time - np.minimum(SAME * end.sigma, 0.25 * lasted) - spacing
    begin = np.searchsorted(known.time, after, "left")
    stop = np.searchsorted(known.time, before, "right") - 1
    good = end.met & start.met & (stop - begin + 1 >= np.maximum(FEWEST, (last - first + 1) // 2))
    return np.where(good, begin, first), np.where(good, stop, last)


def _one_touch(known: Track, every: Runs, start: Touches, end: Touches) -> np.ndarray:
    """Return whether each flight begins with the very impact that ended the one before, (k,)."""
    same = np.zeros(len(start.time), bool)
    apart = start.time[1:] - end.time[:-1]
    slack = SAME * np.hypot(start.sigma[1:], end.sigma[:-1]) + 2.0 * known.spacing
    leaves = start.velocity[1:] * np.where(every.left[1:] == REVERSE, -1.0, 1.0)
    thrown = (leaves > BLOW * start.velocity_sigma[1:]) & (leaves > THROWN * np.abs(end.velocity[:-1]))
    touch = ((apart < slack) & (leaves > 0.0)) | ((apart < HELD) & thrown)
    same[1:] = (every.left[1:] == every.struck[:-1]) & touch
    return same


def _tangents(paths: Parabolas, where: Shafts, every: Runs, start: Touches, end: Touches, same: np.ndarray) -> Touches:
    """Return the starts, those without an impact moved to where the flank is left tangentially."""
    glide = np.flatnonzero(~same)
    if not len(glide):
        return start
    some = paths.some(glide)
    lasted = end.time[glide] - start.time[glide]
    before = np.insert(end.time[:-1], 0, -np.inf)[glide]
    inner = start.time[glide] + 0.3 * lasted
    back = np.maximum(inner - before, 0.3 * lasted)
    span = -np.minimum(back, 0.8 * lasted)
    found = leave(some, where, every.left[glide], inner, span)
    mended = [column.copy() for column in start]
    for column, values in zip(mended, found, strict=True):
        column[glide] = values
    return Touches(*mended)
