"""Impact against impact."""

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.comparison.matching import REACH, Table, match, reach


def compare_trajectories(
    impacts: Table, reference: Table, period: float, begin: float, end: float, least_height: float
) -> dict[str, Any]:
    """Pair the impacts and measure the pairs.

    All impacts take part in the pairing; only then is it asked which count: a pair when either of its flights was
    higher than ``least_height``, a single impact when its own was. So an impact near that height on one side is no
    missed one on the other. Unpaired impacts closer to the end of the records than their counterpart might lie are
    passed over.

    Args:
        impacts: of the recording under test, the contract's columns, (k,).
        reference: of the reference, (l,).
        period: of the excitation [s].
        begin: of what counts [s].
        end: of what counts [s].
        least_height: of the flights before impacts that count [m]; unknown heights count.

    Returns:
        Fields of :class:`gears3d.comparison.Comparison`.
    """
    mine, theirs = match(impacts, reference, period)
    high, high_reference = (_counting(table, least_height) for table in (impacts, reference))
    time = reference["time_s"][theirs]
    kept = (high[mine] | high_reference[theirs]) & (time >= begin) & (time <= end)
    missed = _single(reference, theirs, period, begin, end) & high_reference
    invented = _single(impacts, mine, period, begin, end) & high
    mine, theirs = mine[kept], theirs[kept]
    return {
        "impacts_compared": len(mine) + int(missed.sum()),
        "impacts_matched": len(mine),
        "impacts_missed": int(missed.sum()),
        "impacts_invented": int(invented.sum()),
        **_errors(impacts, reference, mine, theirs, period),
        "pairs": np.column_stack([mine, theirs]),
        "missed": np.flatnonzero(missed),
        "invented": np.flatnonzero(invented),
    }


def _counting(table: Table, least_height: float) -> np.ndarray:
    return ~(table["flight_height_m"] <= least_height)


def _single(table: Table, paired: np.ndarray, period: float, begin: float, end: float) -> np.ndarray:
    """Return which impacts have no partner though the records go on long enough to show it."""
    time = table["time_s"]
    far = np.full(len(time), REACH * period)
    for flank in (0, 1):
        which = np.flatnonzero(table["flank"] == flank)
        far[which] = reach(time[which], period)
    single = (time >= begin) & (time + far <= end)
    single[paired] = False
    return single


def _errors(
    impacts: Table, reference: Table, mine: np.ndarray, theirs: np.ndarray, period: float
) -> dict[str, float | None]:
    speed, truth = np.abs(impacts["velocity_m_s"][mine]), np.abs(reference["velocity_m_s"][theirs])
    moving = truth > 0.0
    relative = (speed[moving] - truth[moving]) / truth[moving]
    cycles = (impacts["phase_rad"][mine] - reference["phase_rad"][theirs]) / (2 * np.pi)
    cycles -= np.rint(cycles)
    later = (impacts["time_s"][mine] - reference["time_s"][theirs]) / period
    cycles = np.abs(np.where(np.isfinite(cycles), cycles, later))
    return {
        "velocity_error_median": float(np.median(np.abs(relative))) if relative.size else None,
        "velocity_error_p95": float(np.quantile(np.abs(relative), 0.95)) if relative.size else None,
        "velocity_bias": float(relative.mean()) if relative.size else None,
        "phase_error_median_cycles": float(np.median(cycles)) if cycles.size else None,
    }
