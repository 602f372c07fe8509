"""A record segmented into flights and contacts: flanks are tried until flights pass the χ² test."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation.cutting import DROPPED, WRONG, Cut, cut_along
from gears3d.measured.segmentation.explained import NotExplained, unexplained
from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.flights import Touches, crossings
from gears3d.measured.segmentation.kinks import Kinks, kinks
from gears3d.measured.segmentation.parabolas import Parabolas
from gears3d.measured.segmentation.search import (
    MOST,
    QUIET,
    find_flanks,
    moved,
    one_flank,
    plain_flanks,
    refined,
    shown_orders,
)
from gears3d.measured.segmentation.smoothing import Blocks, Shape, Track
from gears3d.measured.segmentation.tables import Columns, Segments, contacts_between, flight_table, impacts_of
from gears3d.measured.segmentation.touching import within
from gears3d.measured.segmentation.zones import ACTIVE, REVERSE, Runs, clearance
from gears3d.signals import robust_deviation

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
    chi2, sane = cut.segments.flights["chi2"], cut.segments.flights["testifies"]
    if len(chi2) and np.nanmedian(chi2) < WRONG and np.mean(sane) > TOO_FEW:
        return cut.segments
    what = "leaves what looks like a flank, but without an impact on it"
    if len(chi2):
        what = f"moves between what look like flanks, but not as in flight (chi-square {np.nanmedian(chi2):.3g})"
    remedy = "the counts are too coarse, or the flanks too wavy, or nothing rattles"
    raise NotExplained(Fault("theta_loose_rad", what, remedy, file))


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
