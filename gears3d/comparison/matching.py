"""Impact by impact: which impacts of two recordings belong together, and how they differ."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

REACH = 0.05  # Impacts further apart than this part of a period are never one
SPACINGS = 2.0  # Nor those further apart than so many spacings of the reference's neighbouring impacts on the flank

Table = dict[str, np.ndarray]


def match(impacts: Table, reference: Table, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Pair the impacts of two recordings.

    On each flank the pairs keep the order of time. Among all such pairings within reach, the one is taken that pairs
    most impacts with the least differences in time and speed, so that in a burst of bounces the first goes with the
    first even when the burst has drifted by more than its own spacing.

    Returns:
        Indices into ``impacts`` and into ``reference``, (p,) each, in order of the reference.

    >>> one = {"time_s": np.array([0.1, 0.6]), "flank": np.array([0, 1]), "velocity_m_s": np.array([-0.02, 0.02])}
    >>> mine, theirs = match({name: values[1:] for name, values in one.items()}, one, 1.0)
    >>> mine.tolist(), theirs.tolist()
    ([0], [1])
    """
    mine, theirs = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
    for flank in (0, 1):
        a, r = (np.flatnonzero(table["flank"] == flank) for table in (impacts, reference))
        if a.size and r.size:
            pairs = _match_flank(_taken(impacts, a), _taken(reference, r), period)
            mine.append(a[pairs[:, 0]])
            theirs.append(r[pairs[:, 1]])
    found, partner = np.concatenate(mine), np.concatenate(theirs)
    order = np.argsort(partner, kind="stable")
    return found[order], partner[order]


def _taken(table: Table, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times and the logarithms of the speeds."""
    return table["time_s"][which], np.log(np.maximum(np.abs(table["velocity_m_s"][which]), 1e-12))


def reach(times: np.ndarray, period: float) -> np.ndarray:
    """Return how far from each impact its counterpart may lie [s], (k,).

    >>> reach(np.array([0.0, 0.01, 1.0]), 1.0).tolist()
    [0.02, 0.02, 0.05]
    """
    gaps = np.diff(times, prepend=-np.inf, append=np.inf)
    spacing = np.minimum(gaps[:-1], gaps[1:])
    return np.clip(SPACINGS * spacing, 1e-6 * period, REACH * period)


def _match_flank(
    mine: tuple[np.ndarray, np.ndarray], theirs: tuple[np.ndarray, np.ndarray], period: float
) -> np.ndarray:
    """Return the pairs (index, index of the reference) on one flank, (p, 2)."""
    (time, speed), (other, other_speed) = mine, theirs
    far = reach(other, period)
    low = np.searchsorted(time, other - far, "left")
    high = np.searchsorted(time, other + far, "right")
    pairs: list[tuple[int, int]] = []
    for first, last in _islands(low, high):
        begin, end = int(low[first:last].min()), int(high[first:last].max())
        if last - first == 1 and end - begin == 1:
            pairs.append((begin, first))
            continue
        apart = np.abs(time[None, begin:end] - other[first:last, None]) / far[first:last, None]
        unlike = np.abs(speed[None, begin:end] - other_speed[first:last, None])
        score = np.where(apart <= 1.0, 2.0 - 0.5 * apart - 0.49 * np.minimum(unlike, 1.0), -np.inf)
        pairs += [(begin + j, first + i) for i, j in _align(score)]
    return np.array(pairs, dtype=int).reshape(-1, 2)


def _islands(low: np.ndarray, high: np.ndarray) -> list[tuple[int, int]]:
    """Split the reference's impacts where no candidate is shared across; those without candidates are left out."""
    some = np.flatnonzero(high > low)
    if not some.size:
        return []
    apart = np.maximum.accumulate(high[some])[:-1] <= np.minimum.accumulate(low[some][::-1])[::-1][1:]
    edges = [0, *(np.flatnonzero(apart) + 1).tolist(), len(some)]
    return [(int(some[a]), int(some[b - 1]) + 1) for a, b in pairwise(edges)]


def _align(score: np.ndarray) -> list[tuple[int, int]]:
    """Return the pairs of the best order-preserving alignment; -inf forbids a pair.

    Source: Needleman & Wunsch 1970, with free gaps.

    >>> _align(np.array([[1.0, 1.5], [-np.inf, 1.0]]))
    [(0, 0), (1, 1)]
    """
    rows, columns = score.shape
    best = np.zeros((rows + 1, columns + 1))
    for i in range(rows):
        best[i + 1, 1:] = np.maximum.accumulate(np.maximum(best[i, 1:], best[i, :-1] + score[i]))
    pairs = []
    i, j = rows, columns
    while i and j:
        if best[i, j] == best[i - 1, j]:
            i -= 1
        elif best[i, j] == best[i, j - 1]:
            j -= 1
        else:
            i, j = i - 1, j - 1
            pairs.append((i, j))
    return pairs[::-1]


def compare_trajectories(
    impacts: Table, reference: Table, period: float, begin: float, end: float, least_height: float
) -> dict[str, Any]:
    """Pair the impacts and measure the pairs.

    All impacts take part in the pairing; only then is it asked which count: a pair when either of its flights was
    higher than ``least_height``, a single impact when its own was. So an impact near that height on one side is no
    missed one on the other. Unpaired impacts closer to the end of the records than their counterpart might lie are
    passed over.

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
    """Return which impacts have no partner though the records are long enough to show it."""
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
