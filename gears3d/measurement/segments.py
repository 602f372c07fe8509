"""A record cut into flights and contacts, every flight with its own test of noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measurement.flanks import Flanks, find_flanks, one_flank, refined
from gears3d.measurement.flights import Shafts, Touches, crossings, meet, shafts
from gears3d.measurement.kinks import Kinks, kinks
from gears3d.measurement.orders import within
from gears3d.measurement.parabolas import FEWEST, SURE, Parabolas, common_law, fit, slope_within
from gears3d.measurement.smoothing import Blocks, Track, blocks
from gears3d.measurement.tables import Columns, contacts_between, flight_table, impacts_of
from gears3d.measurement.zones import (
    ACTIVE,
    CUT,
    FLIGHT,
    REVERSE,
    Runs,
    clearance,
    readings_of,
    runs,
    touches_missed,
    zones,
)

BLOW = 5.0
"""Deviations by which the speed of an approach must differ from rest; a bump of the flank has none."""
DROPPED = ("too_short", "no_blow", "cut_off")
"""Why a stretch above a flank is no flight: too few readings, no speed at its end, cut by an end of the record."""
SAME = 4.0
"""Deviations within which the end of a flight and the start of the next are one touch."""

HELD = 5e-3
"""Longest impact of yielding teeth [s]; what stays longer on a flank is in contact."""
THROWN = 0.15
"""Part of the speed of approach with which a gear must leave a flank that held it."""
WRONG = 5.0
"""Median chi-square of flights from which on the flanks are not believed."""
TOO_FEW = 0.2
"""Part of the flights that must pass their own test, for the flanks to be believed."""
SCALES_TRIED = (4, 3, 5)
"""How many scales of kinks are looked with, until flights pass their own test."""
AGAIN = 2
"""Times that the flanks are drawn anew through what turned out to be contact."""


class Segments(NamedTuple):
    """A record cut into flights and contacts.

    Args:
        track: what was measured.
        path: the same in blocks.
        flanks: of the record.
        flights: whole flights, in order of time: ``start_s``, ``end_s``, ``left``, ``struck`` (flanks),
            ``start_sigma_s``, ``end_sigma_s``; against the flank ``velocity_m_s`` at the end and ``departure_m_s`` at
            the start, with sigmas; ``blow`` (1 when it began with an impact), ``height_m``, ``deceleration_rad_s2``
            with sigma, ``omega_loose_rad_s`` and ``theta_loose_rad`` at half time, ``slope_1_s`` (change of the
            deceleration with the loose gear's speed, common to all, 0 where there is none to be seen), ``chi2`` (per
            degree of freedom), ``readings``, ``testifies`` (1 when its chi-square is no wonder), each (k,).
        contacts: ``flank``, ``start_s``, ``end_s``, ``duration_s`` with sigma, each (c,).
        impacts: columns of the contract, and ``time_sigma_s``, ``velocity_sigma_m_s``, ``rebound_sigma_m_s``,
            ``duration_s`` (NaN where not resolved) with sigma, ``duration_max_s``, ``testifies``, each (i,).
        dropped: how many stretches above a flank were no flights, by reason.
        slope: change of the deceleration with speed that flights ask for, and its standard deviation [1/s].
    """

    track: Track
    path: Blocks
    flanks: Flanks
    flights: Columns
    contacts: Columns
    impacts: Columns
    dropped: dict[str, int]
    slope: tuple[float, float] = (0.0, np.inf)

    def states(self, time: np.ndarray) -> np.ndarray:
        """Return the state at given times: 0 active, 1 reverse contact, 2 flight, int8 (n,).

        Args:
            time: [s], (n,).
        """
        state = np.full(len(time), FLIGHT, dtype=np.int8)
        begin = np.searchsorted(time, self.contacts["start_s"], "left")
        end = np.searchsorted(time, self.contacts["end_s"], "right")
        for flank, first, stop in zip(self.contacts["flank"].astype(int), begin, end, strict=True):
            state[first:stop] = flank
        return state


def segment(
    known: Track,
    teeth: tuple[int, int] | None = None,
    file: str = "",
    progress: Callable[[float], None] | None = None,
) -> Segments:
    """Cut a record into flights and contacts by the position in the gap.

    Args:
        known: displacement and angles.
        teeth: of drive and loose gear where known, for mesh orders of the flanks.
        file: named in faults.
        progress: called now and then with the part that is done, 0 to 1.

    Raises:
        InputError: the noise fills the dead band, or what lies between the flanks is no flight.
    """
    tell = progress or _quiet
    path = blocks(known)
    tell(0.1)
    seeds = kinks(path, SCALES_TRIED[0])
    single, still = _resting(path, teeth)
    faults: list[Fault] = []
    tell(0.2)
    for scales in SCALES_TRIED:
        seeds = seeds if scales == SCALES_TRIED[0] else kinks(path, scales)
        if still and (len(seeds.at) < 2 or single.terms.grown):
            break
        for both in (True, False) if len(seeds.at) >= 2 else ():
            try:
                if (found := _between_flanks(known, path, seeds, teeth, both, file, tell)) is not None:
                    return found
            except InputError as error:
                faults += error.faults
    if still or not faults:
        return _no_rattle(known, path, single)
    raise InputError(faults[:1])


def _resting(path: Blocks, teeth: tuple[int, int] | None) -> tuple[Flanks, bool]:
    """Return the flank of a record of contact alone, and whether the path never leaves it.

    A rattle in step with the revolution has orders, too, but none that round its impacts off.
    """
    plain = one_flank(path, teeth)
    least = max(3.0 * path.noise, path.slack)
    if plain.rough < least:
        return plain, True
    wavy = one_flank(path, teeth, grow=True)
    if wavy.rough < least:
        off = path.place - wavy.places(path.time, path.drive, path.loose)[0]
        if len(kinks(path._replace(place=off), SCALES_TRIED[0]).at) < 2:
            return wavy, True
    return plain, False


def _quiet(part: float) -> None:
    """Tell nobody."""


def _between_flanks(
    known: Track,
    path: Blocks,
    seeds: Kinks,
    teeth: tuple[int, int] | None,
    both: bool,
    file: str,
    tell: Callable[[float], None],
) -> Segments | None:
    """Return the record cut along the flanks that kinks tell; ``None`` where two flanks are one.

    Raises:
        InputError: the noise fills the dead band, or what lies between the flanks is no flight.
    """
    flanks = find_flanks(path, seeds, teeth, both)
    if both and (flanks.gap is None or flanks.gap[0] < 3.0 * clearance(path, flanks)):
        return None
    tell(0.4)
    cut = _cut(known, path, flanks, seeds, file)
    for turn in range(AGAIN):
        tell(0.6 + 0.4 * turn / AGAIN)
        flanks = refined(path, flanks, *_evidence(path, cut))
        cut = _cut(known, path, flanks, seeds, file)
    chi2, sane = cut.segments.flights["chi2"], cut.segments.flights["testifies"]
    if len(chi2) and np.nanmedian(chi2) < WRONG and np.mean(sane) > TOO_FEW:
        return cut.segments
    what = "leaves what looks like a flank, but never strikes it"
    if len(chi2):
        what = f"moves between what look like flanks, but not as in flight (chi-square {np.nanmedian(chi2):.3g})"
    raise InputError(Fault("theta_loose_rad", what, "the counts are too coarse, or the flanks too wavy", file))


def _no_rattle(known: Track, path: Blocks, flanks: Flanks) -> Segments:
    """Return a record that is one contact with the active flank."""
    return Segments(known, path, flanks, *_rest(known), dict.fromkeys(DROPPED, 0))


class _Cut(NamedTuple):
    segments: Segments
    paths: Parabolas
    where: Shafts


def _evidence(path: Blocks, cut: _Cut) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, ...]]:
    """Return what tells where the flanks are: blocks within contacts, and crossings of flights."""
    contacts, flights = cut.segments.contacts, cut.segments.flights
    near = [within(path.time, contacts, path.width, flank) for flank in (ACTIVE, REVERSE)]
    side = np.repeat([ACTIVE, REVERSE], [len(one) for one in near])
    of = np.flatnonzero(flights["blow"]) - 1
    time, drive, loose, place, sigma = crossings(cut.paths, cut.where, of, flights["end_s"][of])
    return (np.concatenate(near), side), (time, drive, loose, flights["struck"][of], place, sigma)


def _cut(known: Track, path: Blocks, flanks: Flanks, seeds: Kinks, file: str) -> _Cut:
    """Cut a record along given flanks."""
    zone, above, below = zones(path, flanks, seeds, file)
    every, first, last, dropped, edges = _candidates(known, path, zone, above, below)
    rough = fit(known, first, last)
    if len(wrong := np.flatnonzero(rough.chi2 > WRONG)):
        zone = touches_missed(zone, above, below, every, wrong, clearance(path, flanks))
        every, first, last, dropped, edges = _candidates(known, path, zone, above, below)
        rough = fit(known, first, last)
    where = shafts(known, path, flanks)
    start, end = _touches(known, path, every, fit(known, first, last, law=common_law(rough)), where)
    first, last = _between(known, start, end, first, last)
    slope = slope_within(known, first, last)
    curved = slope[0] if abs(slope[0]) > SURE * slope[1] else 0.0
    free = fit(known, first, last, curved)
    tied = fit(known, first, last, curved, common_law(free))
    start, end = _touches(known, path, every, tied, where)
    real = end.met & (np.abs(end.velocity) > BLOW * end.velocity_sigma) & (end.time > start.time)
    dropped["no_blow"] = int(np.count_nonzero(~real))
    every = Runs(*(column[real] for column in every))
    start, end = (Touches(*(column[real] for column in one)) for one in (start, end))
    free, tied = free.some(real), tied.some(real)
    same = _one_touch(known, every, start, end)
    start = _tangents(tied, where, every, start, end, same)
    flights = flight_table(every, free, start, end, same)
    contacts, impacts = contacts_between(flights, edges), impacts_of(flights, same)
    found = Segments(known, path, flanks, flights, contacts, impacts, dropped, slope)
    return _Cut(found, tied, where)


def _candidates(
    known: Track, path: Blocks, zone: np.ndarray, above: np.ndarray, below: np.ndarray
) -> tuple[Runs, np.ndarray, np.ndarray, dict[str, int], tuple[float, float, int]]:
    """Return runs that may be flights, their first and last readings, what was dropped, and what is known in all."""
    every = runs(zone, above, below)
    first, last = readings_of(every, path.size, len(known.time))
    enough = last - first + 1 >= FEWEST
    whole = (every.left != CUT) & (every.struck != CUT)
    dropped: dict[str, int] = dict.fromkeys(DROPPED, 0)
    dropped["too_short"] = int(np.count_nonzero(~enough & whole))
    dropped["cut_off"] = int(np.count_nonzero(~whole))
    keep = enough & whole
    edges = _ends_beyond(known, path, every, whole)
    return Runs(*(column[keep] for column in every)), first[keep], last[keep], dropped, edges


def _rest(known: Track) -> tuple[Columns, Columns, Columns]:
    """Return the tables of a record that does not rattle: one contact with the active flank."""
    nothing = np.zeros(0)
    whole = nothing.astype(int)
    none = Runs(whole, whole, whole, whole, nothing)
    empty = Parabolas(nothing, np.ones(0), np.zeros((0, 3)), np.zeros((0, 3, 3)), nothing, nothing, nothing)
    never = Touches(nothing, nothing, nothing, nothing, nothing.astype(bool))
    flights = flight_table(none, empty, never, never, nothing.astype(bool))
    edges = (float(known.time[0]), float(known.time[-1]), ACTIVE)
    return flights, contacts_between(flights, edges), impacts_of(flights, nothing.astype(bool))


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


def _touches(known: Track, path: Blocks, every: Runs, paths: Parabolas, where: Shafts) -> tuple[Touches, Touches]:
    """Return where flights begin and end, as if all began with a blow."""
    size = path.size
    inner = known.time[every.first * size], known.time[np.minimum((every.last + 1) * size, len(known.time)) - 1]
    lasted = inner[1] - inner[0]
    reach = np.maximum(0.5 * lasted, 6.0 * path.width)
    after = np.append(inner[0][1:], known.time[-1])
    before = np.insert(inner[1][:-1], 0, known.time[0])
    inside = 0.4 * lasted
    late = np.maximum(np.minimum(reach, after - inner[1]), path.width)
    early = np.maximum(np.minimum(reach, inner[0] - before), path.width)
    never = np.zeros(len(lasted), bool)
    end = meet(paths, where, every.struck, inner[1] - inside, late + inside, never)
    start = meet(paths, where, every.left, inner[0] + inside, -(early + inside), never)
    return start, end


def _between(
    known: Track, start: Touches, end: Touches, first: np.ndarray, last: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the readings that surely lie between the touches; those of before where there are too few."""
    spacing = float(np.median(np.diff(known.time)))
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
    slack = SAME * np.hypot(start.sigma[1:], end.sigma[:-1]) + 2.0 * float(np.median(np.diff(known.time)))
    leaves = start.velocity[1:] * np.where(every.left[1:] == REVERSE, -1.0, 1.0)
    thrown = (leaves > BLOW * start.velocity_sigma[1:]) & (leaves > THROWN * np.abs(end.velocity[:-1]))
    touch = ((apart < slack) & (leaves > 0.0)) | ((apart < HELD) & thrown)
    same[1:] = (every.left[1:] == every.struck[:-1]) & touch
    return same


def _tangents(paths: Parabolas, where: Shafts, every: Runs, start: Touches, end: Touches, same: np.ndarray) -> Touches:
    """Return the starts, those without a blow moved to where the flank is left tangentially."""
    glide = np.flatnonzero(~same)
    if not len(glide):
        return start
    some = paths.some(glide)
    lasted = end.time[glide] - start.time[glide]
    before = np.insert(end.time[:-1], 0, -np.inf)[glide]
    inner = start.time[glide] + 0.3 * lasted
    back = np.maximum(inner - before, 0.3 * lasted)
    span = -np.minimum(back, 0.8 * lasted)
    found = meet(some, where, every.left[glide], inner, span, np.ones(len(glide), bool))
    mended = [column.copy() for column in start]
    for column, values in zip(mended, found, strict=True):
        column[glide] = values
    return Touches(*mended)
