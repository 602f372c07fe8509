"""Contact loss without an impact: the back-extrapolated gap rate at the slowest opening of the gap.

Contact is lost when the loose gear would have to be pulled. Where flight and contact have the same torques, the gap
then opens from rest with the third power of time, and its time cannot be resolved. But the flight is a parabola that is
known far better than its beginning. Back-extrapolated to the moment at which the gap's acceleration passes through
zero, it meets the flank at rest; where the torques of contact decelerate the gear by Δa more than those of flight,
contact is lost later, and the back-extrapolated parabola closes there at ½·Δa²/j, j being the rate at which the
acceleration grows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.measured.segmentation.flights import Shafts, shafts
from gears3d.measured.segmentation.parabolas import Parabolas, common_law, fit

if TYPE_CHECKING:
    from gears3d.measured.segmentation.segments import Segments

Array = np.ndarray
# Distance of a flight's readings from its ends, in standard deviations of the ends, of at most that many seconds each.
CLEAR, LATEST = 4.0, 1e-3
# Minimum number of readings of a flight.
FEWEST = 24
# Search range of the slowest opening of the gap, back from and into a flight, relative to its duration.
BACK, INTO = 0.75, 0.3
# Number of moments in the search range.
POINTS = 192
# Moments to either side for the derivative of rates.
BESIDE = 3
# Points of the flight from that moment on.
LATER = 65


class Leaving(NamedTuple):
    """Contact losses of flights.

    Args:
        flight: index of each, (l,).
        time: of the slowest opening of the gap of the back-extrapolated flight [s], (l,).
        rate: of the gap at that time [m/s], (l,).
        sigma: of the rate [m/s], (l,).
        growth: the gap's acceleration after that time is g1·τ + g2·τ² + g3·τ³ [m/s³, m/s⁴, m/s⁵], (l, 3).
        span: τ until which this holds [s], (l,).
        after: τ from 0 to the last reading of the flight [s], (l, LATER).
        ahead: angle that the loose gear then has turned on its parabola [rad], (l, LATER).
        begun: τ of the first reading [s], (l,).
        curved: change of the deceleration with the loose gear's speed that the parabola has [1/s], (l,).
    """

    flight: Array
    time: Array
    rate: Array
    sigma: Array
    growth: Array
    span: Array
    after: Array
    ahead: Array
    begun: Array
    curved: Array


def leaving(cut: Segments, which: Array) -> Leaving:
    """Return the contact losses of flights that begin without an impact, ambiguous ones excluded.

    which: (f,).
    """
    paths, kept = _paths(cut, which)
    if not len(kept):
        none = np.zeros(0)
        later = np.zeros((0, LATER))
        return Leaving(np.zeros(0, int), none, none, none, np.zeros((0, 3)), none, later, later, none, none)
    where = shafts(cut.track, cut.path, cut.flanks)
    start, end = (cut.flights[name][which[kept]] for name in ("start_s", "end_s"))
    before = np.append(-np.inf, cut.flights["end_s"])[which[kept]]
    since = np.maximum(start - BACK * (end - start), before)
    grid = since[:, None] + (start + INTO * (end - start) - since)[:, None] * np.linspace(0.0, 1.0, POINTS)
    rate = _rate(paths, where, grid, cut.flights["left"][which[kept]].astype(int))
    time, least, sigma, at = _slowest(paths, where, grid, rate)
    growth = np.array([_growth(*each) for each in zip(grid, rate, time, least, at, strict=True)])
    good = np.isfinite(time) & (growth[:, 0] > 0.0)
    span = grid[:, -1] - time
    paths, time = paths.some(good), time[good]
    since = time[:, None]
    after = (paths.middle + paths.half - time)[:, None] * np.linspace(0.0, 1.0, LATER)
    ahead, begun = paths.at(since + after) - paths.at(since), paths.middle - paths.half - time
    return Leaving(
        which[kept][good], time, least[good], sigma[good], growth[good], span[good], after, ahead, begun, paths.slope
    )


def _paths(cut: Segments, which: Array) -> tuple[Parabolas, Array]:
    """Return the parabolas of flights with the deceleration shared in a record, and which flights have one."""
    known, table = cut.track, cut.flights
    spacing = float(np.median(np.diff(known.time)))
    first = table["start_s"] + CLEAR * np.minimum(table["start_sigma_s"], LATEST) + spacing
    last = table["end_s"] - CLEAR * np.minimum(table["end_sigma_s"], LATEST) - spacing
    begin, stop = np.searchsorted(known.time, first), np.searchsorted(known.time, last) - 1
    sane = np.flatnonzero((table["testifies"] == 1) & (stop - begin + 1 >= FEWEST))
    slope = float(np.median(table["slope_1_s"])) if len(sane) else 0.0
    law = common_law(fit(known, begin[sane], stop[sane], slope)) if len(sane) else None
    kept = np.flatnonzero(np.isin(which, sane))
    return fit(known, begin[which[kept]], stop[which[kept]], slope, law), kept


def _rate(paths: Parabolas, where: Shafts, grid: Array, flank: Array) -> Array:
    """Return the gap rate of parabolas at times [m/s], (l, g)."""
    step = BESIDE * (grid[:, 1:2] - grid[:, :1])
    side = np.broadcast_to(flank[:, None], grid.shape)
    later, sooner = (where.gap(grid + k * step, paths.at(grid + k * step), side) for k in (1.0, -1.0))
    return (later - sooner) / (2.0 * step)


def _slowest(paths: Parabolas, where: Shafts, grid: Array, rate: Array) -> tuple[Array, Array, Array, Array]:
    """Return the interior minima of rates: time (NaN without one), rate, its standard deviation, index, each (l,)."""
    each, step = np.arange(len(grid)), grid[:, 1] - grid[:, 0]
    least = np.argmin(rate, axis=1)
    reach = np.minimum(4 * BESIDE, np.minimum(least, POINTS - 1 - least))
    inner = reach > BESIDE
    best, reach = np.where(inner, least, POINTS // 2), np.where(inner, reach, BESIDE)
    at = np.linspace(-1.0, 1.0, 9)
    bow = np.array([np.polyfit(at * r * h, np.interp(b + at * r, np.arange(POINTS), row), 2)
                    for r, h, b, row in zip(reach, step, best, rate, strict=True)])  # fmt: skip
    good = inner & (bow[:, 0] > 0.0)
    ahead = np.where(good, -0.5 * bow[:, 1] / np.where(good, bow[:, 0], 1.0), 0.0)
    time = grid[each, best] + np.clip(ahead, -reach * step, reach * step)
    lowest = bow[:, 2] + 0.5 * bow[:, 1] * ahead - bow[:, 0] * (BESIDE * step) ** 2 / 3.0  # by the differences
    _, turning = paths.spread(time[:, None])
    sigma = np.hypot(where.radii[1] * turning[:, 0], where.radii[0] * where.drive.speed_sigma)
    return np.where(good, time, np.nan), lowest, sigma, best


def _growth(grid: Array, rate: Array, time: float, least: float, best: int) -> Array:
    """Return the growth of the gap's acceleration after its slowest opening, (3,)."""
    after = grid[best:-BESIDE] - time
    if not np.isfinite(time) or len(after) < 4 * BESIDE or after[-1] <= 0.0:
        return np.full(3, np.nan)
    x = np.maximum(after, 0.0) / after[-1]
    rows = np.column_stack([x**2 / 2.0, x**3 / 3.0, x**4 / 4.0])
    return np.linalg.lstsq(rows, rate[best:-BESIDE] - least, rcond=None)[0] / after[-1] ** np.array([2.0, 3.0, 4.0])
