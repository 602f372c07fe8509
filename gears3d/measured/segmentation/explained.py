"""Explained part of a record, and the tests that a segmentation must pass before its results are reported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation.touching import within
from gears3d.measured.segmentation.zones import ACTIVE, FLIGHT, REVERSE, clearance

if TYPE_CHECKING:
    from gears3d.measured.segmentation.tables import Segments

# Part of the time that must be explained: the rest may hold as many impacts as 20 % of those found.
ENOUGH = 0.8
# Part of the dead band, or of the range of the displacement, by which contact may be off its flank at most.
NEAR = 0.1
# Part of the dead band by which two halves of a record may differ, by thermal drift, at any standard error.
AGREE = 0.05
# Standard deviations from which the difference of two halves is significant: p = 3e-5.
SURE = 4.0
# Parts of a record, the scatter of which gives the uncertainty of a flank; every other one is held out.
PARTS = 16
# Flights whose decelerations are compared.
FEWEST = 8
# Standard deviation over size, or over scatter, up to which a deceleration counts as known.
KNOWN = 0.3
# Part of the stretches off the flanks, by time, that must be flights.
LIKELY = 0.5


class Explanation(NamedTuple):
    """What a segmentation explains.

    Args:
        time: part of the time that is contact on a flank within noise, or flight that passes its test.
        path: part of the way of the displacement in that time.
        reasons: why it is not to be believed; empty where it is.
    """

    time: float
    path: float
    reasons: tuple[str, ...]


class NotExplained(InputError):
    """The motion of a record is not explained by flights and contact.

    Args:
        fault: what is to be said.
        explanation: of the best segmentation; ``None`` where there was none.
    """

    def __init__(self, fault: Fault, explanation: Explanation | None = None) -> None:
        super().__init__(fault)
        self.explanation = explanation


def unexplained(cut: Segments) -> np.ndarray:
    """Return which blocks a segmentation does not explain, (m,).

    These are the blocks of flights that fail their test, those of contact further from their flank than noise and
    10 % of the dead band, and those of impacts further behind it: teeth deflect by a small part of their backlash.
    """
    path, flights = cut.path, cut.flights
    state = cut.states(path.time)
    low, high = cut.flanks.places(path.time, path.drive, path.loose)
    off = np.abs(np.where(state == REVERSE, high - path.place, path.place - low))
    most = max(5.0 * path.stray, path.slack, NEAR * _extent(cut))
    astray = (state != FLIGHT) & (off > min(clearance(path, cut.flanks), most))
    astray |= np.maximum(low - path.place, path.place - high) > most
    for k in np.flatnonzero(flights["testifies"] == 0):
        first, stop = np.searchsorted(path.time, (flights["start_s"][k], flights["end_s"][k]))
        astray[first:stop] = True
    return astray


def explain(cut: Segments) -> Explanation:
    """Return what a segmentation explains, and which tests it fails.

    Args:
        cut: the record.
    """
    astray = unexplained(cut)
    way = np.abs(np.gradient(cut.path.place))
    time = 1.0 - float(np.mean(astray))
    path = 1.0 - float(way[astray].sum() / max(way.sum(), 1e-300))
    if not len(cut.flights["start_s"]):
        return Explanation(time, path, ())
    reasons = []
    if time < ENOUGH:
        reasons.append(f"flights and contact explain {time:.0%} of the time")
    reasons += [reason for test in (_few, _decelerations, _predicted, _halves) if (reason := test(cut))]
    return Explanation(time, path, tuple(reasons))


def backlash_sigma(cut: Segments) -> float:
    """Return the standard deviation of the mean dead band [m], the scatter between parts of the record included."""
    found = cut.flanks.backlash
    assert found is not None
    parts = _gaps(cut)
    known = parts[np.isfinite(parts)]
    scatter = float(np.std(known, ddof=1)) / np.sqrt(len(known)) if len(known) > 2 else 0.0
    return float(np.hypot(found[1], scatter))


def _extent(cut: Segments) -> float:
    """Return the dead band [m], or the range of the displacement where there is one flank."""
    if cut.flanks.gap is not None:
        return float(cut.flanks.gap[0])
    return float(np.subtract(*np.quantile(cut.path.place, (0.99, 0.01))))


def _few(cut: Segments) -> str:
    """Return the reason why too little of the motion off the flanks is flight."""
    if cut.flanks.gap is not None and cut.lowest > cut.flanks.gap[0]:
        return "stretches as high as the dead band are no flights"
    state = cut.states(cut.path.time)
    low, high = cut.flanks.places(cut.path.time, cut.path.drive, cut.path.loose)
    clear = clearance(cut.path, cut.flanks)
    away = (cut.path.place - low > clear) & (high - cut.path.place > clear)
    flown = np.count_nonzero(away & (state == FLIGHT))
    if flown < LIKELY * np.count_nonzero(away):
        return f"{flown / max(np.count_nonzero(away), 1):.0%} of the time between the flanks is flight"
    return ""


def _decelerations(cut: Segments) -> str:
    """Return the contradiction between the decelerations of flights: drag is similar in all."""
    flights = cut.flights
    sane = flights["testifies"] == 1
    way = np.sign(flights["omega_loose_rad_s"])[sane]
    slowing, sigma = way * flights["deceleration_rad_s2"][sane], flights["deceleration_sigma_rad_s2"][sane]
    lasts = (flights["end_s"] - flights["start_s"])[sane]
    if len(slowing) < FEWEST:
        return ""
    middle = _median(slowing, lasts)
    spread = 1.4826 * _median(np.abs(slowing - middle), lasts)
    good = sigma < KNOWN * max(abs(middle), spread)
    if np.count_nonzero(good) < FEWEST:
        return ""
    slowing, sigma, lasts = slowing[good], sigma[good], lasts[good]
    middle = _median(slowing, lasts)
    spread = 1.4826 * _median(np.abs(slowing - middle), lasts)
    own = float(np.sqrt(max(spread**2 - _median(sigma, lasts) ** 2, 0.0)))
    if own > abs(middle):
        return f"decelerations of flights contradict each other ({middle:.3g} rad/s² in the middle, scatter {own:.3g})"
    other = (slowing * np.sign(middle) < -SURE * sigma) & (np.abs(slowing) > 0.5 * abs(middle))
    if float(lasts[other].sum()) > (1.0 - ENOUGH) * float(lasts.sum()):
        return f"{lasts[other].sum() / lasts.sum():.0%} of the flights accelerate where the others are decelerated"
    return ""


def _median(values: np.ndarray, weight: np.ndarray) -> float:
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, 0.5 * share[-1])])


def _touched(cut: Segments, flank: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and distances from a flank [m] of blocks in contact with it, and of its impacts."""
    path = cut.path
    near = within(path.time, cut.contacts, path.width, flank)
    mine = (cut.impacts["flank"] == flank) & (cut.impacts["testifies"] == 1)
    time = np.append(path.time[near], cut.impacts["time_s"][mine])
    place, drive, loose = (np.interp(time, path.time, column) for column in (path.place, path.drive, path.loose))
    off = place - cut.flanks.places(time, drive, loose)[flank]
    # an impact's block lies off the flank by 0.25 of its width times the speed of approach
    rounded = np.append(np.zeros(len(near)), 0.5 * path.width * np.abs(cut.impacts["velocity_m_s"][mine]))
    keep = np.abs(off) < clearance(path, cut.flanks) + rounded
    return time[keep], off[keep]


def _by_part(cut: Segments, flank: int) -> np.ndarray:
    """Return the median distance from a flank in each part of the record [m], NaN without contact, (PARTS,)."""
    time, off = _touched(cut, flank)
    part = np.clip((time - cut.path.time[0]) / max(np.ptp(cut.path.time), 1e-300) * PARTS, 0, PARTS - 1).astype(int)
    return np.array([np.median(off[part == k]) if np.any(part == k) else np.nan for k in range(PARTS)])


def _gaps(cut: Segments) -> np.ndarray:
    """Return the dead band in each part of the record [m], NaN where a flank is not touched, (PARTS,)."""
    assert cut.flanks.gap is not None
    return cut.flanks.gap[0] + _by_part(cut, REVERSE) - _by_part(cut, ACTIVE)


def _halves(cut: Segments) -> str:
    """Return by how much the dead band differs between the halves of the record."""
    if cut.flanks.gap is None:
        return ""
    parts = _gaps(cut)
    halves = [half[np.isfinite(half)] for half in (parts[: PARTS // 2], parts[PARTS // 2 :])]
    if min(len(half) for half in halves) < 2:
        return ""
    one, other = (float(np.mean(half)) for half in halves)
    sigma = float(np.hypot(*(np.std(half, ddof=1) / np.sqrt(len(half)) for half in halves)))
    if abs(one - other) > max(SURE * sigma, AGREE * float(cut.flanks.gap[0])):
        return f"the backlash differs between the halves of the record, {1e6 * one:.4g} and {1e6 * other:.4g} um"
    return ""


def _predicted(cut: Segments) -> str:
    """Return how flanks fitted to every other part of the record miss the parts that were held out.

    Each half of the parts gives the numbers of the flanks within their expected sizes; the other must lie on these.
    """
    path, terms = cut.path, cut.flanks.terms
    allowed = max(5.0 * path.stray, path.slack, NEAR * _extent(cut))
    missed, total = 0, 0
    for flank in (ACTIVE, REVERSE) if cut.flanks.gap is not None else (ACTIVE,):
        near = within(path.time, cut.contacts, path.width, flank)
        off = path.place[near] - cut.flanks.places(path.time[near], path.drive[near], path.loose[near])[flank]
        near = near[np.abs(off) < allowed]  # what is further is unexplained as it is
        near = near[:: max(len(near) // 4000, 1)]
        stretches = int(np.count_nonzero(cut.contacts["flank"] == flank))  # blocks of one contact are one place
        if stretches < 2 * len(terms.prior) or len(near) < 4 * len(terms.prior):
            continue
        columns = terms.columns(path.time[near], path.drive[near], path.loose[near])
        part = ((path.time[near] - path.time[0]) / max(np.ptp(path.time), 1e-300) * PARTS).astype(int) % 2
        prior = (terms.prior if flank == ACTIVE else terms.both[: len(terms.prior)]) * _extent(cut)
        for held in (0, 1):
            ours, theirs = columns[part != held], columns[part == held]
            if len(ours) < len(prior) or not len(theirs):
                continue
            scale = max(path.stray, cut.flanks.rough)
            normal = ours.T @ ours / scale**2 + np.diag(prior**-2.0)
            numbers = np.linalg.solve(normal, ours.T @ path.place[near][part != held] / scale**2)
            off = path.place[near][part == held] - theirs @ numbers
            missed += int(np.count_nonzero(np.abs(off) > allowed))
            total += len(off)
    if missed > (1.0 - ENOUGH) * total:
        return f"flanks fitted to half of the record miss {missed / total:.0%} of the contact in the other half"
    return ""


def refuse(explanation: Explanation, file: str) -> None:
    """Refuse what is not explained.

    Raises NotExplained when a test fails.
    """
    if explanation.reasons:
        raise NotExplained(fault_of(explanation.reasons, file), explanation)


def fault_of(reasons: Sequence[str], file: str = "") -> Fault:
    """Return the fault of a record that is not explained."""
    what = f"does not move as a gear that flies freely between two flanks: {'; '.join(reasons)}"
    tried = "one and two flanks were tried, constant ones and ones with orders; impacts and backlash are withheld"
    help_ = "`visible` has what is seen; check rig, ratio and mounting, record faster or with less noise"
    return Fault("theta_loose_rad", what, f"{tried}; {help_}", file)
