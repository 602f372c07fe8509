"""Pairs of approach and rebound from measured impacts, and the rebound below which a record sees none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from gears3d.identify.restitution.places import speeds_set_right
from gears3d.signals import noise_of

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.recording import Recording

ABOVE = 2.0
"""Heights of the lowest flight seen that a rebound must reach to be taken: so high, none is overlooked."""
BLOCKS = 6.0
"""Blocks of averaged readings that its flight must last."""
SLOPES = 1e-3
"""Time about an impact over which the drive's speed is taken [s]."""


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
        """With ``flights``."""
        ...


class Pairs(NamedTuple):
    """Impacts with the speeds before and after them, away from the record's own threshold of sight.

    Args:
        record: which record, (n,).
        time: [s], (n,).
        flank: 0 active, 1 reverse, (n,).
        approach: speed against the flank before, above 0 [m/s], (n,).
        rebound: after, above 0; NaN where no rebound was seen [m/s], (n,).
        approach_sigma: [m/s], (n,).
        rebound_sigma: [m/s], NaN without rebound, (n,).
        lowest: rebound above which none is overlooked [m/s], (n,).
        sliding: typical sliding speed of the teeth [m/s], (n,).
        kind: of the motion: 2 where the approach came across the gap, plus 1 where the rebound goes there, (n,).
    """

    record: np.ndarray
    time: np.ndarray
    flank: np.ndarray
    approach: np.ndarray
    rebound: np.ndarray
    approach_sigma: np.ndarray
    rebound_sigma: np.ndarray
    lowest: np.ndarray
    sliding: np.ndarray
    kind: np.ndarray

    def only(self, chosen: np.ndarray) -> Pairs:
        """Return some of the impacts.

        Args:
            chosen: mask or indices.
        """
        return Pairs(*(column[chosen] for column in self))

    @property
    def side(self) -> np.ndarray:
        """+1 on the active, −1 on the reverse flank, (n,)."""
        return np.where(self.flank == 0, 1.0, -1.0)

    @property
    def seen(self) -> np.ndarray:
        """Whether the rebound was seen and lies above ``lowest``, (n,)."""
        return np.nan_to_num(self.rebound, nan=0.0) > self.lowest


def pairs_of(measured: Sequence[Measured], rig: Rig) -> Pairs:
    """Return the impacts of measured records whose flights pass for flights.

    Args:
        measured: records.
        rig: gears, for the sliding of their teeth.
    """
    return _joined([_of_one(index, one, rig) for index, one in enumerate(measured)])


def _joined(parts: list[Pairs]) -> Pairs:
    return Pairs(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _of_one(index: int, one: Measured, rig: Rig) -> Pairs:
    recording, summary, flights = one.recording, one.summary, one.segments.flights
    hits, quality = recording.impacts, summary["quality"]
    time, flank = hits["time_s"], np.asarray(hits["flank"], dtype=int)
    approach, rebound = np.abs(hits["velocity_m_s"]), np.abs(hits["rebound_m_s"])
    if len(flights["blow"]) == len(time) > 1:
        track = one.segments.track
        more = speeds_set_right(flights, lambda at: track.steady.curve(at, 2), track.radii)
        short = ~np.isfinite(hits["duration_s"])  # blows that last have no one moment
        approach, rebound = (
            speed + np.where(short, add, 0.0) for speed, add in zip((approach, rebound), more, strict=True)
        )
    height, width = float(quality["flight_height_min_m"]), float(quality["averaged_over_s"])
    most = greatest_fall(recording, float(summary["cut"]["deceleration_median_rad_s2"] or 0.0), rig)
    lowest = lowest_rebound(time, flank, approach, rebound, height, width, most)
    sane = hits["testifies"] == 1
    after = np.append(sane[1:], False)  # the flight that the rebound begins is told by the impact that ends it
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
    """Return the rebound above which a record overlooks none [m/s], (n,); infinity where it shows no bounce.

    A bounce of rebound w falls back on its flank with the acceleration a; it rises by w²/2a and lasts 2w/a. The
    greatest acceleration is taken that bounces of the record have shown on a flank.

    Args:
        time: of the impacts [s], (n,).
        flank: 0 active, 1 reverse, (n,).
        approach: [m/s], (n,).
        rebound: [m/s], NaN where it was not seen, (n,).
        height: of the lowest flight seen [m].
        width: over which readings were averaged [s].
        most: acceleration that no fall exceeds, for records without any bounce [m/s²].

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

    Args:
        recording: with the angle of the drive gear.
        slowing: deceleration of the loose gear in flight [rad/s²].
        rig: base radii.
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

    A record does not tell where on the teeth an impact falls; over a path of contact of length g that is centred on the
    pitch point, the distance is g/4 in the mean, and teeth slide with ω1 + ω2 times it.

    Args:
        recording: with the angle of the drive gear.
        time: of the impacts [s], (n,).
        rig: gears.

    Source: ISO 21771, sliding speed.
    """
    angle, clock = recording.signals["theta_drive_rad"], recording.time
    spacing = float(np.median(np.diff(clock)))
    half = max(0.5 * SLOPES, 5.0 * spacing)
    early, late = (np.clip(time + way, clock[0], clock[-1]) for way in (-half, half))
    turning = np.abs(np.interp(late, clock, angle) - np.interp(early, clock, angle)) / np.maximum(late - early, spacing)
    path = rig.contact_ratio * 2.0 * np.pi * rig.base_radius_drive / rig.teeth_drive
    return turning * (1.0 + rig.base_radius_drive / rig.base_radius_loose) * 0.25 * path
