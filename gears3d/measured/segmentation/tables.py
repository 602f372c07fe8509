"""Tables of a segmented record: flights, contacts, impacts, each column by its name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.flights import Touches
from gears3d.measured.segmentation.parabolas import Parabolas
from gears3d.measured.segmentation.smoothing import Blocks, Track
from gears3d.measured.segmentation.zones import FLIGHT, Runs, clearance
from gears3d.recording import Recording
from gears3d.results import Result
from gears3d.scenario import Scenario

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
            deceleration with the loose gear's speed, common to all, 0 where none is seen), ``chi2`` (per
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
