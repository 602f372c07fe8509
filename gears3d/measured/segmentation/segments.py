"""A record segmented into flights and contacts: flanks are tried until flights pass the χ² test."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation.displacement import Blocks, Kinks, Shape, Track, kinks
from gears3d.measured.segmentation.flank_search import (
    MOST,
    QUIET,
    find_flanks,
    moved,
    one_flank,
    plain_flanks,
    refined,
    shown_orders,
)
from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.flights import (
    ACTIVE,
    CUT,
    REVERSE,
    Runs,
    Shafts,
    Touches,
    clearance,
    crossings,
    leave,
    meet,
    readings_of,
    runs,
    shafts,
    touches_missed,
    zones,
)
from gears3d.measured.segmentation.parabolas import FEWEST, SURE, Parabolas, common_law, fit, slope_within, tied
from gears3d.measured.segmentation.results import (
    Columns,
    NotExplained,
    Segments,
    contacts_between,
    flight_table,
    impacts_of,
    unexplained,
    within,
)
from gears3d.signals import robust_deviation

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
# Part of the dead band behind the reverse flank from which on compliant teeth and errors of encoders bring no gear,
# and part of the time that the path may be there.
FAR_BEHIND, BEHIND = 0.2, 0.01
# Part of the flights that must pass the χ² test, for the flanks to be accepted.
TOO_FEW = 0.2
# Numbers of scales of velocity jumps tried, until flights pass the χ² test.
SCALES_TRIED = (4, 3, 5)
# Part of a record that may stay unexplained before other velocity jumps are tried, too.
PLAIN = 0.005
# Part of a record that stays unexplained, from which on its segmentation is reported with a warning.
DOUBTFUL = 0.05
# Blocks in contact with a flank below which its scatter is not assessed.
CALM_FEWEST = 50
# Part of a record by which orders may explain less before they are excluded.
SLIGHT = 1e-3
# Times its noise that contact may scatter beyond smooth flanks.
CHATTER = 2.5
# Part of the impacts on one of two flanks below which a single flank is tried, too.
RARE = 0.2
# Median impact speed in standard deviations from which impacts are certain.
FAST = 10.0
# Refits of the flanks to the contact found, at most.
AGAIN = 2
# Shift of the flanks over the noise (root mean square) below which segmentation has converged: about the scatter
# between other selections of contact.
SETTLED = 0.25


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


def segment(
    known: Track,
    teeth: tuple[int, int] | None = None,
    file: str = "",
    progress: Callable[[float], None] | None = None,
    shapes: tuple[Shape, ...] = (),
) -> Segments:
    """Segment a record into flights and contacts by the position in the gap.

    Args:
        known: displacement and angles.
        teeth: of drive and loose gear where known, for mesh orders of the flanks.
        file: named in faults.
        progress: called now and then with the part that is done, 0 to 1.
        shapes: that flanks may have besides orders.

    Raises:
        InputError: the noise fills the dead band, or the motion between the flanks is not a flight.
    """
    tell = progress or _quiet
    path = known.blocks._replace(shapes=shapes)
    tell(0.1)
    seeds = kinks(path, SCALES_TRIED[0])
    single = one_flank(path, teeth)
    still = single.rough < max(3.0 * path.stray, path.slack)
    smooth = None if len(seeds.at) < 2 else _smooth(known, path, seeds, teeth, file, tell)
    if not still:
        if smooth is not None and doubtful(smooth) < PLAIN:
            return smooth  # a rattle in step with the revolution has orders, too
        single, still = _resting(path, teeth, single)
    faults: list[InputError] = []
    tell(0.2)
    best, least, drawn = None, np.inf, single
    for scales in SCALES_TRIED:
        seeds = seeds if scales == SCALES_TRIED[0] else kinks(path, scales)
        if still and (len(seeds.at) < 2 or single.terms.grown):
            break
        if best is None and len(seeds.at) >= 2:
            found = smooth if scales == SCALES_TRIED[0] else _smooth(known, path, seeds, teeth, file, tell)
            if found is not None:
                return found
        sides = () if len(seeds.at) < 2 else (True, False) if best is None else (True,)
        for both in sides:
            few = _with_few_orders(known, path, seeds, teeth, both, file)
            if few is not None and doubtful(few) < PLAIN:
                return few
            flanks = find_flanks(path, seeds, teeth, both)
            if best is not None and not _moved(path, drawn, flanks):
                return best  # other velocity jumps show the same flanks
            try:
                found = _cut_between(known, path, flanks, seeds, both, file, tell)
            except InputError as error:
                faults.append(error)
                found = None
            if few is not None and (found is None or doubtful(few) <= doubtful(found) + PLAIN):
                found = few
            if found is not None and (doubt := doubtful(found)) < least:
                best, least, drawn = found, doubt, flanks
            if best is not None:
                break
        if least < PLAIN:
            break
    if best is not None:
        return best
    if still or not faults:
        return _no_rattle(known, path, single)
    raise faults[0]


def alike(known: Track, like: Flanks, file: str = "") -> Segments:
    """Segment a record with the flanks of another record of the same gears, at any angular datum.

    A gear without sustained contact determines its flanks poorly, but it bounces off the same flanks.

    Args:
        known: displacement and angles, with the same zeros of both.
        like: flanks of the other record.
        file: named in faults.

    Raises:
        InputError: the noise fills the dead band, or the motion between the flanks is not a flight.
    """
    path = known.blocks._replace(shapes=like.terms.shapes)
    seeds = kinks(path, SCALES_TRIED[0])
    flanks = moved(path, like, seeds)
    cut = None if flanks is None else _cut_between(known, path, flanks, seeds, like.gap is not None, file, _quiet)
    if cut is None:
        raise InputError(Fault("theta_loose_rad", "bounces off nothing that is sure to be a flank", "", file))
    return cut


def doubtful(cut: Segments) -> float:
    """Return the part of a record that the segmentation does not explain.

    That is the time of flights that fail their test, and of contacts further from their flank than noise allows.

    Args:
        cut: the record.
    """
    return float(np.mean(unexplained(cut)))


def _resting(path: Blocks, teeth: tuple[int, int] | None, plain: Flanks) -> tuple[Flanks, bool]:
    """Return the flank of a record of contact alone, and whether the path never leaves it.

    Rattle synchronous with the revolution has orders, too, but they do not reproduce its impacts.
    """
    least = max(3.0 * path.stray, path.slack)
    wavy = one_flank(path, teeth, True, least)
    if wavy.rough < least:
        off = path.place - wavy.places(path.time, path.drive, path.loose)[0]
        if len(kinks(path._replace(place=off), SCALES_TRIED[0]).at) < 2:
            return wavy, True
    return plain, False


def _quiet(part: float) -> None:
    """Report no progress."""


def _with_few_orders(
    known: Track, path: Blocks, seeds: Kinks, teeth: tuple[int, int] | None, both: bool, file: str
) -> Segments | None:
    """Return the record segmented with low orders alone, or with mesh orders, where nothing lies behind such flanks.

    Bounces that are too low to be seen count as contact, on the inner side of the flank, and imitate orders: more of
    these are looked for only where contact itself asks for them. Where either flank tells one phase of an order, both
    have it alike first.
    """
    best: Segments | None = None
    for mesh, alike in ((False, True), (False, False), (True, True)):
        flanks = find_flanks(path, seeds, teeth, both, grow=False, mesh=mesh, alike=alike)
        found = _tried(known, path, flanks, seeds, both, file, _quiet)
        if found is None or not _calm(path, found, inner=False):
            continue
        if best is None or doubtful(found) < doubtful(best) - PLAIN:
            best = found
        if doubtful(best) < PLAIN:
            break
    return best


def _smooth(
    known: Track,
    path: Blocks,
    seeds: Kinks,
    teeth: tuple[int, int] | None,
    file: str,
    tell: Callable[[float], None],
) -> Segments | None:
    """Return the record segmented with smooth flanks where these explain nearly all of it, else ``None``."""
    taken: Segments | None = None
    for both in (True, False):
        flanks = plain_flanks(path, seeds, teeth, both)
        if flanks is None:
            continue
        found = _tried(known, path, flanks, seeds, both, file, tell)
        if found is None or (doubt := doubtful(found)) > DOUBTFUL or not _calm(path, found, CHATTER, inner=False):
            continue
        if taken is None or doubt <= doubtful(taken) + SLIGHT:  # one flank explains as much: no second one is reported
            taken = found
        if _struck_often(taken):
            break
    if taken is None:
        return None
    evidence = _evidence(path, cut_along(known, path, taken.flanks, seeds, file))
    shown = shown_orders(path, taken.flanks, *evidence, teeth)
    both = taken.flanks.gap is not None
    wavy = None if shown is None else _tried(known, path, shown, seeds, both, file, _quiet)
    return taken if wavy is None or doubtful(wavy) > doubtful(taken) + SLIGHT else wavy


def _struck_often(cut: Segments) -> bool:
    """Return whether impacts on either flank are too many and too fast to be the tops of equally high flights."""
    if cut.flanks.gap is None:
        return False
    struck, speed = cut.impacts["flank"], np.abs(cut.impacts["velocity_m_s"]) / cut.impacts["velocity_sigma_m_s"]
    each = [speed[struck == flank] for flank in (ACTIVE, REVERSE)]
    return min(len(one) for one in each) > RARE * len(struck) and min(float(np.median(one)) for one in each) > FAST


def _tried(
    known: Track, path: Blocks, flanks: Flanks, seeds: Kinks, both: bool, file: str, tell: Callable[[float], None]
) -> Segments | None:
    """Return the record segmented with flanks, ``None`` where that is not possible."""
    try:
        return _cut_between(known, path, flanks, seeds, both, file, tell)
    except InputError:
        return None


def _calm(path: Blocks, cut: Segments, quiet: float = QUIET, inner: bool = True) -> bool:
    """Whether contact deviates from its flanks by at most so many times its noise.

    Without ``inner`` only blocks beyond a flank are tested: bounces too low to be seen lie on its inner side.
    """
    flanks = cut.flanks.places(path.time, path.drive, path.loose)
    clear = 2.0 * clearance(path, cut.flanks)
    for flank, sign in ((ACTIVE, 1.0), (REVERSE, -1.0)):
        near = within(path.time, cut.contacts, path.width, flank)
        off = sign * (path.place[near] - flanks[flank][near])
        off = off[np.abs(off) < clear] if not inner else off  # larger deviations are not contact, but unexplained
        if len(off) < CALM_FEWEST:
            continue
        scatter = robust_deviation(off) if inner else -float(np.quantile(off, 0.16))
        if scatter > quiet * path.stray:
            return False
    return True


def _cut_between(
    known: Track, path: Blocks, flanks: Flanks, seeds: Kinks, both: bool, file: str, tell: Callable[[float], None]
) -> Segments | None:
    """Return the record segmented with flanks that are fitted again as long as segmentation moves them."""
    if both and (flanks.gap is None or flanks.gap[0] < 3.0 * clearance(path, flanks)):
        return None
    tell(0.4)
    cut = cut_along(known, path, flanks, seeds, file)
    for turn in range(AGAIN):
        tell(0.6 + 0.4 * turn / AGAIN)
        before, flanks = flanks, refined(path, flanks, *_evidence(path, cut))
        if turn and not _moved(path, before, flanks):
            break
        cut = cut_along(known, path, flanks, seeds, file)
    if _behind(path, flanks) > BEHIND:
        what = "is for a considerable time behind what looks like the reverse flank"
        raise NotExplained(Fault("theta_loose_rad", what, "record impacts on both flanks, or a smaller backlash", file))
    chi2, sane = cut.segments.flights["chi2"], cut.segments.flights["testifies"]
    if len(chi2) and np.nanmedian(chi2) < WRONG and np.mean(sane) > TOO_FEW:
        return cut.segments
    what = "leaves what looks like a flank, but without an impact on it"
    if len(chi2):
        what = f"moves between what look like flanks, but not as in flight (chi-square {np.nanmedian(chi2):.3g})"
    remedy = "the counts are too coarse, or the flanks too wavy, or nothing rattles"
    raise NotExplained(Fault("theta_loose_rad", what, remedy, file))


def _behind(path: Blocks, flanks: Flanks) -> float:
    """Return the part of the time in which the path is far behind the reverse flank, where a gear cannot be."""
    if flanks.gap is None:
        return 0.0
    low, high = flanks.places(path.time, path.drive, path.loose)
    return float(np.mean(path.place - high > FAR_BEHIND * (high - low) + clearance(path, flanks)))


def _moved(path: Blocks, before: Flanks, now: Flanks) -> bool:
    """Whether flanks have moved by more than the scatter between selections of places on them."""
    some = slice(None, None, max(len(path.time) // MOST, 1))
    angles = path.time[some], path.drive[some], path.loose[some]
    one, other = (flanks.places(*angles) for flanks in (before, now))
    with np.errstate(invalid="ignore"):
        moved = [float(np.sqrt(np.mean(np.square(a - b)))) for a, b in zip(one, other, strict=True)]
    return any(each > SETTLED * path.noise for each in moved)


def _no_rattle(known: Track, path: Blocks, flanks: Flanks) -> Segments:
    """Return a record that is one contact with the active flank."""
    return Segments(known, path, flanks, *_rest(known), dict.fromkeys(DROPPED, 0))


def unsegmented(known: Track) -> Segments:
    """Return a record with its path alone: no flight, no contact, and a constant flank."""
    path = known.blocks
    flights, contacts, impacts = _rest(known)
    contacts = {name: values[:0] for name, values in contacts.items()}
    return Segments(known, path, one_flank(path), flights, contacts, impacts, dict.fromkeys(DROPPED, 0))


def _rest(known: Track) -> tuple[Columns, Columns, Columns]:
    """Return the tables of a record that does not rattle: one contact with the active flank."""
    nothing = np.zeros(0)
    whole = nothing.astype(int)
    none = Runs(whole, whole, whole, whole, nothing)
    empty = Parabolas(
        nothing,
        np.ones(0),
        np.zeros((0, 3)),
        np.zeros((0, 3, 3)),
        nothing,
        nothing,
        nothing,
        nothing,
        np.zeros((0, 9)),
        nothing,
        nothing,
        nothing,
    )
    never = Touches(nothing, nothing, nothing, nothing, nothing.astype(bool), nothing.astype(bool))
    flights = flight_table(none, empty, never, never, nothing.astype(bool))
    edges = (float(known.time[0]), float(known.time[-1]), ACTIVE)
    return flights, contacts_between(flights, edges), impacts_of(flights, nothing.astype(bool))


def _evidence(path: Blocks, cut: Cut) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, ...]]:
    """Return the evidence of the flanks: blocks within contacts, and crossings of flights."""
    contacts, flights = cut.segments.contacts, cut.segments.flights
    near = [within(path.time, contacts, path.width, flank) for flank in (ACTIVE, REVERSE)]
    side = np.repeat([ACTIVE, REVERSE], [len(one) for one in near])
    of = np.flatnonzero(flights["blow"]) - 1
    time, drive, loose, place, sigma = crossings(cut.paths, cut.where, of, flights["end_s"][of])
    short = np.isnan(cut.segments.impacts["duration_s"][of])
    return (np.concatenate(near), side), (time, drive, loose, flights["struck"][of], place, sigma, short)
