"""Contact episodes: short paths of the loose gear from the middle of the gap to a flank and back, without segmentation.

The motion on a flank, or in the last micrometres before it, is lost once a record is segmented into flights and
contacts by rigid flanks. Here nothing is segmented: an episode begins in the middle of the gap, where only the drag
acts, and continues for a few falls across the gap; its start is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.gears import Pair
    from gears3d.measured.segmentation.smoothing import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Step of the grid [s].
STEP = 1.25e-4
# Grid steps per point.
PER = 4
# Maximum number of contact episodes of a record.
MOST = 24
# Length of a contact episode, in falls across the gap.
FALLS = 3.0
# Maximum length in seconds.
LONGEST = 0.2
# Minimum number of points of a contact episode.
FEWEST = 24
# Fraction of a fall over which the start is estimated.
BEGIN = 0.12
# Lower limit of the standard deviation of a place [m].
FLOOR = 2e-8


@dataclass(frozen=True, eq=False)
class Visits:
    """Contact episodes of one record.

    Args:
        name: of the record.
        scenario: of the test rig under the record's conditions.
        rig: its constants.
        pair: its nominal gears.
        time: of the grids [s], (w, n).
        drive: angle of the drive on the grids [rad], (w, n).
        rate: of the drive [rad/s], (w, n).
        loose: angle of the loose gear on the grids, smoothed [rad], (w, n).
        sizes: number of valid points of each grid, (w,).
        place: of the loose gear along its base circle, from the episode's own datum [m], (w, k).
        sigma: of the place [m]; infinite beyond the end of an episode, (w, k).
        flank: place of the active flank without deviations, from the same datum, without the record's datum [m], (w,
            n).
        zero: estimate of the record's datum [m].
        starts: estimates of the initial place [m] and speed [m/s], (w, 2).
    """

    name: str
    scenario: Scenario
    rig: Rig
    pair: Pair
    time: Array
    drive: Array
    rate: Array
    loose: Array
    sizes: Array
    place: Array
    sigma: Array
    flank: Array
    zero: float
    starts: Array


def some(records: Sequence[Visits], most: int) -> list[Visits]:
    """Return about a number of contact episodes, spread evenly over the records; at least one of each."""
    every = max(sum(len(one.sizes) for one in records) // most, 1)
    columns = ("time", "drive", "rate", "loose", "sizes", "place", "sigma", "flank", "starts")
    return [replace(one, **{name: getattr(one, name)[::every] for name in columns}) for one in records]


def visits(known: Track, scenario: Scenario, name: str = "") -> Visits | None:
    """Return the contact episodes of a record; ``None`` if the gear is never in the middle of the gap."""
    rig = scenario.rig()
    begins, zero, fall = _begins(known, rig)
    if not len(begins):
        return None
    length = int(min(FALLS * fall, LONGEST) / (STEP * PER))
    grid = np.arange(length * PER + 1) * STEP
    begins = begins[begins + grid[-1] < known.time[-1]]
    if length < FEWEST or not len(begins):
        return None
    begins = begins[np.unique(np.linspace(0, len(begins) - 1, MOST).astype(int))]
    time = begins[:, None] + grid
    edges = begins[:, None] + np.arange(length + 1) * STEP * PER
    loose, sigma = _means(known, edges)
    radii = known.radii
    base = np.nanmean(loose[:, :3], axis=1, keepdims=True)
    origin = float(known.loose[0]) - radii[0] / radii[1] * float(known.drive[0])
    drive, rate = known.steady.curve(time), known.steady.curve(time, 1)
    flank = radii[0] * drive - radii[1] * (base - origin)
    place = radii[1] * (loose - base)
    level = np.hypot(radii[1] * sigma, FLOOR)
    level[~np.isfinite(place)] = np.inf
    place = np.where(np.isfinite(place), place, 0.0)
    middle = (np.arange(length) + 0.5) * STEP * PER
    starts = _starts(middle, place, level, fall)
    smooth = np.array([np.interp(grid, middle, row) for row in place]) / radii[1] + base
    sizes = np.full(len(begins), len(grid))
    return Visits(name, scenario, rig, scenario.pair(), time, drive, rate, smooth, sizes, place, level, flank, zero,
                  starts)  # fmt: skip


def _begins(known: Track, rig: Rig) -> tuple[Array, float, float]:
    """Return times in the middle of the gap, an estimate of the active flank's place, and the duration of a fall."""
    b = rig.backlash
    slowed = max(rig.drag_torque * rig.base_radius_loose / rig.inertia, 1e-3)
    fall = float(np.sqrt(2.0 * b / slowed))
    size = max(int(2.0 * STEP * PER / np.median(np.diff(known.time))), 1)
    count = len(known.time) // size
    time, place = (x[: count * size].reshape(count, size).mean(axis=1) for x in (known.time, known.place))
    low, high = np.quantile(place, [0.002, 0.998])
    zero = 0.5 * (low + high - b) if high - low > 0.8 * b else float(low)
    level = zero + 0.5 * min(b, high - low)
    if high - low < 0.25 * b:
        return np.zeros(0), float(zero), fall
    above = place > level
    crossed = np.flatnonzero(above[1:] != above[:-1])
    begins, last = [], -np.inf
    for at in time[crossed]:
        if at - last > 0.25 * fall:
            begins.append(at)
            last = at
    return np.array(begins), float(zero), fall


def _means(known: Track, edges: Array) -> tuple[Array, Array]:
    """Return interval means of the loose gear's readings, and their standard deviations [rad], (w, k).

    Readings are shifted to the middle of their interval by the gear's mean speed.
    """
    at = np.searchsorted(known.time, edges)
    total = np.concatenate([[0.0], np.cumsum(known.loose - known.loose[0])])
    times = np.concatenate([[0.0], np.cumsum(known.time - known.time[0])])
    square = np.concatenate([[0.0], np.cumsum(known.sigma_loose**2)])
    number = np.diff(at, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.diff(total[at], axis=1) / number + known.loose[0]
        when = np.diff(times[at], axis=1) / number + known.time[0]
        sigma = np.sqrt(np.diff(square[at], axis=1)) / number
    middle = 0.5 * (edges[:, 1:] + edges[:, :-1])
    speed = np.gradient(mean, axis=1) / (STEP * PER)
    return mean + (middle - when) * np.nan_to_num(speed), sigma


def _starts(middle: Array, place: Array, sigma: Array, fall: float) -> Array:
    """Return initial place and speed by a parabola through the first points."""
    few = max(int(BEGIN * fall / (STEP * PER)), 6)
    x = middle[:few]
    columns = np.stack([np.ones_like(x), x, x * x], axis=1)
    return np.linalg.lstsq(columns, place[:, :few].T, rcond=None)[0][:2].T
