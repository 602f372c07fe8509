"""Pairs of approach and rebound speeds of measured impacts, corrected for wrong places of the flanks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from scipy.linalg import block_diag

from gears3d.measured.segmentation.results import depths
from gears3d.recording import FLANKS, refuse_unexplained
from gears3d.signals import noise_of

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.recording import Recording

ABOVE = 2.0  # Heights of the lowest flight seen that a rebound must reach to be taken: above this all are seen
BLOCKS = 6.0  # Blocks of averaged readings that its flight must last
SLOPES = 1e-3  # Time about an impact over which the drive's speed is taken [s]


class Measured(Protocol):
    """A measured record, as ``gears3d.measured.segmentation.measure`` gives it."""

    @property
    def recording(self) -> Recording:
        """With impacts."""
        ...

    @property
    def summary(self) -> Mapping[str, Any]:
        """With ``quality`` and ``cut``."""
        ...

    @property
    def segments(self) -> Any:
        """With ``flights`` and ``flank_speed_errors``."""
        ...


class Pairs(NamedTuple):
    """Impacts with the speeds before and after them, away from the record's own threshold of sight."""

    record: np.ndarray  # which record, (n,)
    time: np.ndarray  # [s], (n,)
    flank: np.ndarray  # 0 active, 1 reverse, (n,)
    approach: np.ndarray  # speed against the flank before, above 0 [m/s], (n,)
    rebound: np.ndarray  # after, above 0; NaN where no rebound was seen [m/s], (n,)
    approach_sigma: np.ndarray  # [m/s], (n,)
    rebound_sigma: np.ndarray  # [m/s], NaN without rebound, (n,)
    lowest: np.ndarray  # rebound above which all are seen [m/s], (n,)
    sliding: np.ndarray  # typical sliding speed of the teeth [m/s], (n,)
    # of the motion: 2 where the approach came across the gap, plus 1 where the rebound goes there, (n,)
    kind: np.ndarray
    # speed of the struck flank by each independent standard error of the flanks [m/s], (n, q); none without flanks
    flank_error: np.ndarray | None = None

    def only(self, chosen: np.ndarray) -> Pairs:
        """Return some of the impacts."""
        return Pairs(*(None if column is None else column[chosen] for column in self))  # type: ignore[arg-type]

    @property
    def side(self) -> np.ndarray:
        """+1 on the active, −1 on the reverse flank, (n,)."""
        return np.where(self.flank == 0, 1.0, -1.0)

    @property
    def seen(self) -> np.ndarray:
        """Whether the rebound was seen and lies above ``lowest``, (n,)."""
        return np.nan_to_num(self.rebound, nan=0.0) > self.lowest


def pairs_of(measured: Sequence[Measured], rig: Rig) -> Pairs:
    """Return the impacts of measured records between flights that pass the χ² test."""
    parts = [_of_one(index, one, rig) for index, one in enumerate(measured)]
    errors = [part.flank_error for part in parts if part.flank_error is not None]
    made = Pairs(*(np.concatenate(columns) for columns in zip(*(part[:-1] for part in parts), strict=True)))
    return made._replace(flank_error=block_diag(*errors) if len(errors) == len(parts) else None)


def _of_one(index: int, one: Measured, rig: Rig) -> Pairs:
    recording, summary, flights = one.recording, one.summary, one.segments.flights
    refuse_unexplained(recording)
    hits, quality = recording.impacts, summary["quality"]
    time, flank = hits["time_s"], np.asarray(hits["flank"], dtype=int)
    approach, rebound = np.abs(hits["velocity_m_s"]), np.abs(hits["rebound_m_s"])
    common = None
    if len(flights["blow"]) == len(time) > 1:
        common = one.segments.flank_speed_errors(time, flank)
        track = one.segments.track
        more = speeds_set_right(flights, lambda at: track.steady.curve(at, 2), track.radii)
        short = ~np.isfinite(hits["duration_s"])  # impacts that last have no single moment
        approach, rebound = (
            speed + np.where(short, add, 0.0) for speed, add in zip((approach, rebound), more, strict=True)
        )
    height, width = float(quality["flight_height_min_m"]), float(quality["averaged_over_s"])
    most = greatest_fall(recording, float(summary["cut"]["deceleration_median_rad_s2"] or 0.0), rig)
    lowest = lowest_rebound(time, flank, approach, rebound, height, width, most)
    sane = hits["testifies"] == 1
    after = np.append(sane[1:], False)  # the impact at its end identifies the flight after a rebound
    good = sane & (after | np.isnan(rebound)) & (approach > 0.0) & (hits["velocity_sigma_m_s"] > 0.0)
    good[-1:] = False  # what follows the last impact is cut off
    sliding = sliding_speed(recording, time, rig)
    whole = Pairs(
        np.full(len(time), index),
        time,
        flank,
        approach,
        rebound,
        hits["velocity_sigma_m_s"],
        hits["rebound_sigma_m_s"],
        lowest,
        sliding,
        2 * (np.insert(flank[:-1], 0, 1 - flank[:1]) != flank) + (np.append(flank[1:], 1 - flank[-1:]) != flank),
        common,
    )
    return whole.only(good)


def lowest_rebound(
    time: np.ndarray,
    flank: np.ndarray,
    approach: np.ndarray,
    rebound: np.ndarray,
    height: float,
    width: float,
    most: float = np.inf,
) -> np.ndarray:
    """Return the rebound above which a record shows all [m/s], (n,); infinity where it shows no bounce.

    A bounce of rebound w falls back on its flank with the acceleration a; it rises by w²/2a and lasts 2w/a. The
    greatest acceleration is taken that bounces of the record have shown on a flank.

    >>> time, flank = np.array([0.0, 1.0, 1.4]), np.zeros(3, int)
    >>> approach, rebound = np.array([2.0, 1.0, 0.4]), np.array([1.0, 0.4, np.nan])
    >>> lowest_rebound(time, flank, approach, rebound, height=0.01, width=1e-3).round(3).tolist()
    [0.283, 0.283, 0.283]
    """
    again = np.flatnonzero((flank[1:] == flank[:-1]) & np.isfinite(rebound[:-1]))
    lasted = time[again + 1] - time[again]
    falls = (rebound[again] + approach[again + 1]) / lasted
    lowest = np.zeros(len(time))
    for side in (0, 1):
        own = falls[flank[again] == side] if np.any(flank[again] == side) else falls
        fall = float(np.quantile(own, 0.95)) if len(own) else most
        lowest[flank == side] = max(np.sqrt(2.0 * fall * ABOVE * height), 0.5 * fall * BLOCKS * width)
    return lowest


def greatest_fall(recording: Recording, slowing: float, rig: Rig) -> float:
    """Return the acceleration towards a flank that no flight of a record exceeds [m/s²].

    It is what slows the loose gear down and the greatest acceleration of the drive, by second differences as short as
    the noise allows.
    """
    clock, angle = recording.time, recording.signals["theta_drive_rad"]
    noise, spacing = noise_of(clock, angle), float(np.median(np.diff(clock)))
    most = np.inf
    for step in 2 ** np.arange(2, int(np.log2(max(len(clock) // 8, 8)))):
        bent = angle[2 * step :] - 2.0 * angle[step:-step] + angle[: -2 * step]
        most = float(np.max(np.abs(bent))) / (step * spacing) ** 2
        if most > 30.0 * noise / (step * spacing) ** 2:
            break
    return rig.base_radius_loose * abs(slowing) + rig.base_radius_drive * most


def sliding_speed(recording: Recording, time: np.ndarray, rig: Rig) -> np.ndarray:
    """Return the sliding speed of teeth at the mean distance of their contacts from the pitch point [m/s], (n,).

    A record does not show where on the teeth an impact occurs; over a path of contact of length g that is centred on
    the pitch point, the distance is g/4 in the mean, and teeth slide with ω1 + ω2 times it.

    Source: ISO 21771, sliding speed.
    """
    angle, clock = recording.signals["theta_drive_rad"], recording.time
    spacing = float(np.median(np.diff(clock)))
    half = max(0.5 * SLOPES, 5.0 * spacing)
    early, late = (np.clip(time + way, clock[0], clock[-1]) for way in (-half, half))
    turning = np.abs(np.interp(late, clock, angle) - np.interp(early, clock, angle)) / np.maximum(late - early, spacing)
    path = rig.contact_ratio * 2.0 * np.pi * rig.base_radius_drive / rig.teeth_drive
    return turning * (1.0 + rig.base_radius_drive / rig.base_radius_loose) * 0.25 * path


DOUBT = 1.5  # Median of depth over its standard deviation from which a flank is not believed; 0.67 where all is right
STRAY = 4.0  # Deviations from the median from which on an impact is not used for the place of its flank
SURE = 0.2  # Relative deviation up to which a flight tells its own deceleration; that of others has the record's median
FEWEST = 4  # Impacts on a flank, at least, for an estimate of its place
# Parts of the fast impacts whose rebound is missed on one flank, while the other shows all but so many
BLIND, CLEAR = 0.25, 0.1


def misplaced(flights: Mapping[str, np.ndarray]) -> dict[int, float]:
    """Return the flanks whose impacts contradict their place, with the typical depth [m]."""
    depth, sigma, flank = depths(flights)
    found = {}
    for code in range(len(FLANKS)):
        own = (flank == code) & (sigma > 0.0)
        if np.count_nonzero(own) >= FEWEST and np.median(np.abs(depth[own]) / sigma[own]) > DOUBT:
            found[code] = float(np.median(np.abs(depth[own])))
    return found


def mean_depths(flights: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return how much deeper than assumed each flank lies in the mean of its impacts [m], (2,).

    A mean within its own standard error is shrunk towards 0. Flanks with an implausible displacement have 0.
    """
    found, beyond = np.zeros(len(FLANKS)), misplaced(flights)
    depth, sigma, flank = depths(flights)
    for code in range(len(FLANKS)):
        own = (flank == code) & (sigma > 0.0)
        if np.count_nonzero(own) < FEWEST or code in beyond:
            continue
        off, weight = depth[own], sigma[own] ** -2.0
        weight = weight * (np.abs(off - np.median(off)) < STRAY * sigma[own])
        if not weight.any():
            continue
        mean = float(np.average(off, weights=weight))
        error = max(float(np.linalg.norm(weight * (off - mean)) / weight.sum()), float(weight.sum()) ** -0.5)
        found[code] = mean * max(1.0 - (error / mean) ** 2, 0.0) if mean else 0.0
    return found


def speeds_set_right(
    flights: Mapping[str, np.ndarray], drive: Callable[[np.ndarray], np.ndarray], radii: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the corrections of each impact's speeds of approach and rebound [m/s], from where paths meet, each (k,).

    Where a flank lies deeper by d, the approach lasts d/v longer and the rebound begins d/w earlier, both under the
    acceleration of the free gear: 0.1 um is 0.5 % of a rebound of 25 mm/s under 40 m/s².
    """
    deep = mean_depths(flights)[np.asarray(flights["struck"], dtype=int)]
    slowing, slack = flights["deceleration_rad_s2"], flights["deceleration_sigma_rad_s2"]
    typical = float(np.median(slowing))
    slowing = np.where(slack < SURE * abs(typical), slowing, typical)
    toward = np.where(np.asarray(flights["struck"]) == 1, 1.0, -1.0)
    after = np.minimum(np.arange(len(slowing)) + 1, len(slowing) - 1)
    late, early = (
        toward * (-radii[1] * slowing[of] - radii[0] * drive(time))
        for of, time in ((np.arange(len(slowing)), flights["end_s"]), (after, flights["start_s"][after]))
    )
    fast, slow = np.abs(flights["velocity_m_s"]), np.abs(flights["departure_m_s"][after])
    return late * deep / np.maximum(fast, 1e-9), early * deep / np.maximum(slow, 1e-9)


def blind(chosen: Pairs) -> int | None:
    """Return the flank of which rebounds are missed while the other shows them."""
    missed = [
        float(np.mean(~chosen.seen[chosen.flank == code])) if np.any(chosen.flank == code) else 1.0 for code in (0, 1)
    ]
    worse = int(np.argmax(missed))
    if np.any(chosen.flank == worse) and missed[worse] > BLIND and missed[1 - worse] < CLEAR:
        return worse
    return None


FEWEST_DURATIONS = 5  # Durations, at least, for a standard deviation


def impact_durations(measured: Sequence[Measured]) -> dict[str, Any]:
    """Return mean, standard deviation and extent of the impacts' durations, by flank.

    Source: Kadmiri et al. 2012, fig. 6: 1.2 ms, normal, standard deviation 0.06 ms.
    """
    tables = [one.recording.impacts for one in measured]
    if not all("duration_s" in table for table in tables):
        return {"resolved": False, "why": "the measurement gives no durations of impacts"}
    lasted = np.concatenate([table["duration_s"] for table in tables])
    flank = np.concatenate([table["flank"] for table in tables])
    found: dict[str, Any] = {}
    for code, name in enumerate(FLANKS):
        own = lasted[(flank == code) & np.isfinite(lasted) & (lasted > 0.0)]
        if len(own) >= FEWEST_DURATIONS:
            found[name] = _told(own)
    if not found:
        return {"resolved": False, "why": "impacts are shorter than the readings resolve"}
    return {"resolved": True, **found}


def _told(lasted: np.ndarray) -> dict[str, Any]:
    from scipy.stats import t

    mean, spread = float(np.mean(lasted)), float(np.std(lasted, ddof=1))
    half = float(t.ppf(0.975, len(lasted) - 1)) * spread / np.sqrt(len(lasted))
    return {
        "impacts": len(lasted),
        "mean_s": {"value": mean, "unit": "s", "ci95": [mean - half, mean + half]},
        "standard_deviation_s": spread,
    }
