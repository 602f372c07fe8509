"""Results of a segmented record: tables of flights, contacts and impacts, orders in contact, and the explained part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation.displacement import Blocks, Track
from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.flights import ACTIVE, FLIGHT, REVERSE, Runs, Touches, clearance
from gears3d.measured.segmentation.orders import (
    MOST,
    STRAY,
    Contact,
    columns_of,
    fluctuation_order,
    in_step,
    resolved,
    strongest,
)
from gears3d.measured.segmentation.parabolas import Parabolas
from gears3d.recording import Recording
from gears3d.results import Result
from gears3d.scenario import Scenario
from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS, deviations, phasors_of

# Deviations that the end of one flight and the start of the next must be apart, for an impact to have a duration.
RESOLVED = 4.0
# Samples that an impact must last: a time offset between encoders of less than a sample imitates durations.
SAMPLES = 2.0
# Deviations of a one-sided 95 % bound.
ONE_SIDED = 1.645
# Part of the stretches above a height that may not be flights, for flights of that height to count as found.
LOST = 0.1
# Readings that a flight needs, with those at both ends that may be contact.
LEAST = 7.0
Columns = dict[str, np.ndarray]

# p-value of chi-square below which a flight fails the goodness-of-fit test.
DOUBT = 1e-3
# Blocks in one of four parts of the contacts from which on its mean counts: its noise is 25 % of one block's.
QUARTER = 20
# Impacts on a flank, at least, for where paths meet.
FEWEST_IMPACTS = 4
# Places that are fitted at most.
ROWS = 20_000
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


class Segments(NamedTuple):
    """A record segmented into flights and contacts.

    Args:
        track: what was measured.
        path: the same in blocks.
        flanks: of the record.
        flights: whole flights, in order of time: ``start_s``, ``end_s``, ``left``, ``struck`` (flanks),
            ``start_sigma_s``, ``end_sigma_s``; against the flank ``velocity_m_s`` at the end and ``departure_m_s`` at
            the start, with sigmas; ``blow`` (1 when it began with an impact), ``height_m``, ``deceleration_rad_s2``
            with sigma, ``omega_loose_rad_s`` and ``theta_loose_rad`` at half time, ``slope_1_s`` (change of the
            deceleration with the loose gear's speed, common to all, 0 where it is not significant), ``chi2`` (per
            degree of freedom), ``readings``, ``testifies`` (1 when it passes the χ² test), each (k,).
        contacts: ``flank``, ``start_s``, ``end_s``, ``duration_s`` with sigma, each (c,).
        impacts: columns of the contract, and ``time_sigma_s``, ``velocity_sigma_m_s``, ``rebound_sigma_m_s``,
            ``duration_s`` (NaN where not resolved) with sigma, ``duration_max_s``, ``testifies``, each (i,).
        dropped: how many stretches above a flank were no flights, by reason.
        slope: change of the deceleration with speed that flights ask for, and its standard deviation [1/s].
        missed: heights of the stretches that were dropped [m], those apart that an end of the record cuts.
    """

    track: Track
    path: Blocks
    flanks: Flanks
    flights: Columns
    contacts: Columns
    impacts: Columns
    dropped: dict[str, int]
    slope: tuple[float, float] = (0.0, np.inf)
    missed: np.ndarray = np.zeros(0)

    @property
    def lowest(self) -> float:
        """Height from which on flights are found [m]: of higher stretches nine in ten are flights, or nearly.

        Apart from noise, flights must last for some readings: of a height h at a deceleration g they last √(8h/g).
        """
        flights, clear = self.flights, clearance(self.path, self.flanks)
        height = flights["height_m"]
        if not len(height):
            return max([clear, *self.missed.tolist()])
        every = np.concatenate([height, self.missed])
        order = np.argsort(-every)
        lost = np.cumsum(order >= len(height))
        good = np.flatnonzero(lost <= LOST * np.arange(1, len(every) + 1))
        seen = float(every[order[good[-1]]]) if len(good) else float(every.max())
        if len(good) == len(every):
            seen = clear
        same = np.flatnonzero(flights["left"] == flights["struck"])
        same = same[np.argsort(height[same])][: max(len(same) // 2, 1)]
        lasts = (flights["end_s"] - flights["start_s"])[same]
        fall = float(np.median(8.0 * height[same] / lasts**2)) if len(same) else 0.0
        needed = max(LEAST * self.track.spacing, 2.0 * self.path.width)
        return max(seen, clear + fall * needed**2 / 8.0)

    def flank_speed_errors(self, time: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return the speed of a flank by each independent standard error of the flanks' place [m/s], (n, q).

        Args:
            time: [s], (n,).
            flank: 0 active, 1 reverse, (n,).
        """
        times = time + 0.5 * self.path.width * np.array([[-1.0], [1.0]])
        loose = np.interp(times, self.path.time, self.path.loose)
        return self.flanks.rate_errors(times, self.track.steady.curve(times), loose, flank)

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


@dataclass(frozen=True, eq=False)
class Measurement(Result):
    """Result of a measured record.

    Args:
        recording: the record with displacement, state and impacts; ``compare``, ``describe``, ``sound`` and ``replay``
            take it.
        segments: flights, contacts and impacts with their uncertainties.
        summary: what JSON can hold.
        rig: scenario of the test rig, where it is known.
    """

    recording: Recording
    segments: Segments
    summary: dict[str, Any]
    rig: Scenario | None = None

    def __repr__(self) -> str:
        return f"Measurement({self.recording!r})"

    def _repr_html_(self) -> str:
        return self.recording._repr_html_()


def flight_table(every: Runs, paths: Parabolas, start: Touches, end: Touches, same: np.ndarray) -> Columns:
    """Return the table of flights.

    ``every``: the runs that are flights, (k,); ``same``: whether each begins with the impact that ended the one before,
    (k,).
    """
    from scipy.special import gammaincc

    slowing, slack = paths.deceleration
    chance = gammaincc(0.5 * paths.freedom, 0.5 * np.nan_to_num(paths.chi2) * paths.freedom)  # of chi-square
    return {
        "start_s": start.time,
        "end_s": end.time,
        "left": every.left.astype(np.int8),
        "struck": every.struck.astype(np.int8),
        "start_sigma_s": start.sigma,
        "end_sigma_s": end.sigma,
        "velocity_m_s": end.velocity,
        "velocity_sigma_m_s": end.velocity_sigma,
        "departure_m_s": start.velocity,
        "departure_sigma_m_s": start.velocity_sigma,
        "blow": same.astype(np.int8),
        "height_m": every.height,
        "deceleration_rad_s2": slowing,
        "deceleration_sigma_rad_s2": slack,
        "omega_loose_rad_s": paths.numbers[:, 1] / paths.half,
        "theta_loose_rad": paths.numbers[:, 0],
        "slope_1_s": paths.slope,
        "chi2": paths.chi2,
        "readings": paths.readings,
        "testifies": (chance > DOUBT).astype(np.int8),
    }


def contacts_between(flights: Columns, edges: tuple[float, float, int]) -> Columns:
    """Return the stretches between flights that are more than one touch.

    ``edges``: begin and end of what is known [s], and the flank it begins on.
    """
    begin = np.append(edges[0], flights["end_s"])
    end = np.append(flights["start_s"], edges[1])
    flank = np.append(edges[2] if not len(flights["left"]) else flights["left"][0], flights["struck"])
    lasts = np.append(flights["blow"] == 0, True) & (end > begin)
    sigmas = np.append(np.nan, flights["end_sigma_s"]), np.append(flights["start_sigma_s"], np.nan)
    return {
        "flank": flank[lasts].astype(np.int8),
        "start_s": begin[lasts],
        "end_s": end[lasts],
        "duration_s": (end - begin)[lasts],
        "duration_sigma_s": np.hypot(*sigmas)[lasts],
    }


def impacts_of(flights: Columns, same: np.ndarray, step: float = 0.0) -> Columns:
    """Return the impacts that end flights; where the next flight begins with it, both give its moment.

    ``duration_s`` is the time from touching to leaving, NaN where the record does not resolve it or no rebound was
    seen; ``duration_max_s`` is its upper bound of 95 %.

    ``same``: whether each flight begins with the impact that ended the one before, (k,); ``step``: distance of the
    samples [s]: a duration below two of them is not resolved.
    """
    time, sigma = flights["end_s"].copy(), flights["end_sigma_s"].copy()
    rebound, slack = np.full(len(time), np.nan), np.full(len(time), np.nan)
    lasted, unsure, most = (np.full(len(time), np.nan) for _ in range(3))
    of = np.flatnonzero(same)
    if len(of):
        apart = flights["start_s"][of] - time[of - 1]
        slack_apart = np.hypot(sigma[of - 1], flights["start_sigma_s"][of])
        seen = apart > np.maximum(RESOLVED * slack_apart, SAMPLES * step)
        lasted[of - 1] = np.where(seen, apart, np.nan)
        unsure[of - 1] = slack_apart
        most[of - 1] = np.maximum(apart, 0.0) + ONE_SIDED * slack_apart
        rebound[of - 1], slack[of - 1] = flights["departure_m_s"][of], flights["departure_sigma_m_s"][of]
        of = of[~seen]
        ours, theirs = sigma[of - 1] ** -2, flights["start_sigma_s"][of] ** -2
        time[of - 1] = (time[of - 1] * ours + flights["start_s"][of] * theirs) / (ours + theirs)
        sigma[of - 1] = (ours + theirs) ** -0.5
    return {
        "time_s": time,
        "flank": flights["struck"],
        "velocity_m_s": flights["velocity_m_s"],
        "rebound_m_s": rebound,
        "flight_height_m": flights["height_m"],
        "time_sigma_s": sigma,
        "velocity_sigma_m_s": flights["velocity_sigma_m_s"],
        "rebound_sigma_m_s": slack,
        "duration_s": lasted,
        "duration_sigma_s": unsure,
        "duration_max_s": most,
        "testifies": flights["testifies"],
    }


def contact_orders(measurement: Measurement, flank: int = 0, most: int = MOST) -> dict[str, np.ndarray]:
    """Return the orders of both gears in the displacement while the gears touch, strongest first.

    An order is significant when noise alone would hardly be as strong, and when it predicts the revolutions
    from which it was not fitted. Phases refer to the datum of the record's own angles.

    Args:
        measurement: of a record.
        flank: 0 active, 1 reverse.
        most: orders that are taken at most.

    Returns:
        ``gear`` (0 drive, 1 loose; the drive's only where both turn equally fast), ``order``, ``amplitude_m``,
        ``sigma_m`` and ``phase_rad`` of amplitude·cos(order·θ + phase), and ``share``, the part of the variance that
        no other order of these explains, each (k,).

    >>> from gears3d.measured.segmentation import measure
    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> wave = [{"kind": "transmission_error", "order": 5, "amplitude": "9 um", "phase": "30 deg"}]
    >>> bench = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"motion.harmonics": [], "effect": wave})
    >>> bench = bench.with_({"sensors.loose.noise": "2e-6 rad"})
    >>> found = contact_orders(measure(record(bench), bench))
    >>> found["order"].tolist(), found["amplitude_m"].round(7).tolist()
    ([5], [9e-06])
    """
    cut = measurement.segments
    path, contacts = cut.path, cut.contacts
    near = within(path.time, contacts, path.width, flank)
    some = near[:: max(len(near) // ROWS, 1)]
    x = (path.time[some] - path.time[0]) / max(float(path.time[-1] - path.time[0]), 1e-300)
    base = np.stack([np.ones_like(x), x - 0.5, (x - 0.5) ** 2], axis=1)
    floor = max(path.noise, path.slack / np.sqrt(3.0))
    touched = Contact(base, np.stack([path.drive[some], path.loose[some]]), path.place[some], floor)
    highest = resolved(path.drive, path.loose)
    taken, numbers, covariance = strongest([touched], highest, most)
    phasors = phasors_of(numbers[0][base.shape[1] :])
    amplitude = np.abs(phasors)
    rank = np.argsort(-amplitude, kind="stable")
    found = {
        "gear": np.array([GEARS.index(gear) for gear, _ in taken], int),
        "order": np.array([order for _, order in taken], int),
        "amplitude_m": amplitude,
        "sigma_m": deviations(covariance[0][base.shape[1] :, base.shape[1] :]),
        "phase_rad": np.angle(phasors),
        "share": shares(touched, taken, numbers[0]),
    }
    return {name: column[rank] for name, column in found.items()}


def within(time: np.ndarray, contacts: dict[str, np.ndarray], width: float, flank: int | None = None) -> np.ndarray:
    """Return the indices of blocks that lie well within contacts.

    ``time``: of the blocks [s], (m,); ``width``: of a block [s]; ``flank``: 0 active, 1 reverse; ``None`` for both.
    """
    mine = np.ones(len(contacts["flank"]), bool) if flank is None else contacts["flank"] == flank
    start, end = contacts["start_s"][mine], contacts["end_s"][mine]
    lasts = end - start
    spare = np.minimum(np.maximum(0.15 * lasts, 2.0 * width), 0.4 * lasts)
    spare = np.minimum(spare, np.maximum(20.0 * width, 5e-3))
    first, stop = np.searchsorted(time, start + spare), np.searchsorted(time, end - spare)
    spans = [np.arange(a, b) for a, b in zip(first, stop, strict=True)]
    return np.concatenate([*spans, np.zeros(0, int)])


def place_slack(cut: Segments) -> tuple[float, float]:
    """Return the bound of the mean error of each flank's position [m]: active, reverse.

    Bounces too low to be resolved lie at the beginning of a contact, on one side of the flank. Their effect is
    bounded by the disagreement of the quarters of the contacts about the flank, or by half the noise of a block where
    no contact lasts long enough to be divided, and by the disagreement of the flank with where paths meet at impacts.
    """
    path, contacts = cut.path, cut.contacts
    slack = []
    lines = cut.flanks.places(path.time, path.drive, path.loose)
    for flank, line in enumerate(lines):
        near = within(path.time, contacts, path.width, flank)
        off = path.place[near] - line[near]
        mine = contacts["flank"] == flank
        start, end = contacts["start_s"][mine], contacts["end_s"][mine]
        own = np.searchsorted(start, path.time[near], "right") - 1
        part = np.floor(4.0 * (path.time[near] - start[own]) / (end[own] - start[own])) if len(near) else off
        close = np.abs(off) < 5.0 * cut.flanks.rough
        quarters = [off[close & (part == k)] for k in range(4)]
        means = [float(np.mean(one)) for one in quarters if len(one) > QUARTER]
        apart = float(np.std(means)) if len(means) > 1 else 0.5 * path.noise
        slack.append(float(np.hypot(apart, _depth(cut, flank))))
    return slack[0], slack[1]


def depths(flights: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the depth of each impact behind the flank, its standard deviation [m], and the flank, each (k,).

    The path before an impact reaches the assumed flank at one moment, the path after it leaves it at another.
    Both paths meet deeper by the time between, over 1/v + 1/w.

    >>> two = {"struck": np.array([0, 0]), "blow": np.array([0, 1]), "end_s": np.array([1.0, 2.0])}
    >>> two |= {"start_s": np.array([0.0, 1.003]), "end_sigma_s": np.ones(2), "start_sigma_s": np.ones(2)}
    >>> two |= {"velocity_m_s": np.array([-2.0, -1.0]), "departure_m_s": np.array([0.0, 1.0])}
    >>> depths(two)[0].round(6).tolist()
    [0.002]
    """
    after = np.flatnonzero(np.asarray(flights["blow"]) == 1)
    after = after[after > 0]
    before = after - 1
    slow = 1.0 / np.abs(flights["velocity_m_s"][before]) + 1.0 / np.maximum(
        np.abs(flights["departure_m_s"][after]), 1e-9
    )
    apart = flights["start_s"][after] - flights["end_s"][before]
    sigma = np.hypot(flights["start_sigma_s"][after], flights["end_sigma_s"][before])
    return apart / slow, sigma / slow, np.asarray(flights["struck"][before], dtype=int)


def _depth(cut: Segments, flank: int) -> float:
    """Return by how much the paths before and after the impacts on a flank meet away from it, in the median [m]."""
    depth, sigma, struck = depths(cut.flights)
    own = depth[(struck == flank) & (sigma > 0.0) & np.isfinite(depth)]
    return float(np.median(own)) if len(own) >= FEWEST_IMPACTS else 0.0


def shares(one: Contact, taken: list[tuple[str, int]], numbers: np.ndarray) -> np.ndarray:
    """Return the growth of the residual without each order, as a part of the residual without any, (k,).

    Where gears touch at some angles only, two orders may nearly cancel: their amplitudes show no share.

    ``numbers``: that were fitted, (p,).
    """
    columns = columns_of(one, taken)
    rest = one.place - columns @ numbers
    keep = np.abs(rest) <= STRAY * max(robust_deviation(rest), one.noise)
    rows, place = columns[keep], one.place[keep]
    base = rows[:, : one.base.shape[1]]
    total = place - base @ np.linalg.lstsq(base, place, rcond=None)[0]
    inverse = np.linalg.pinv(rows.T @ rows, hermitian=True)
    found, first = inverse @ (rows.T @ place), base.shape[1]
    pairs = [slice(at, at + 2) for at in range(first, len(found), 2)]
    more = np.array([found[pair] @ np.linalg.pinv(inverse[pair, pair]) @ found[pair] for pair in pairs])
    return np.clip(more / max(float(total @ total), 1e-300), 0.0, 1.0)


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
    """Return the standard deviation of the mean dead band [m].

    It includes the scatter between parts of the record, and orders that are in step with the fluctuation of the drive:
    at one of its phases rattle meets the reverse flank, and does not distinguish them from the mean.
    """
    found = cut.flanks.backlash
    assert found is not None
    parts = _gaps(cut)
    known = parts[np.isfinite(parts)]
    scatter = float(np.std(known, ddof=1)) / np.sqrt(len(known)) if len(known) > 2 else 0.0
    return float(np.hypot(np.hypot(found[1], scatter), _in_step(cut)))


def orders_in_step(cut: Segments) -> list[tuple[str, int]]:
    """Return gear and number of the orders of the dead band that are in step with the drive's fluctuation."""
    step = fluctuation_order(cut.path.time, cut.path.drive)
    own = [order for kind, order in cut.flanks.terms.kinds if kind in GEARS]
    if step is None or not own:
        return []
    return in_step((max(own), max(own)), [step], cut.track.radii[0] / cut.track.radii[1])


def _in_step(cut: Segments) -> float:
    """Return the root mean square of the dead band's orders in step with the drive's fluctuation [m]."""
    terms, gap, barred = cut.flanks.terms, cut.flanks.gap, orders_in_step(cut)
    if gap is None:
        return 0.0
    power, at = 0.0, 0
    for one in terms.kinds:
        wide = 2 if one[0] in GEARS else 1
        power += 0.5 * float(np.sum(gap[at : at + wide] ** 2)) if one in barred else 0.0
        at += wide
    return float(np.sqrt(power))


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
