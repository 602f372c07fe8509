"""Which impact of one recording is which of the other: one to one, in order, flank by flank."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

REACH = 0.05
"""Impacts further apart than this part of a period are never one."""
SPACINGS = 2.0
"""Nor those further apart than so many spacings of the reference's neighbouring impacts on the flank."""

Table = dict[str, np.ndarray]


def match(impacts: Table, reference: Table, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Pair the impacts of two recordings.

    On each flank the pairs keep the order of time. Among all such pairings within reach, the one is taken that pairs
    most impacts with the least differences in time and speed, so that in a burst of bounces the first goes with the
    first even when the burst has drifted by more than its own spacing.

    Args:
        impacts: ``time_s``, ``flank``, ``velocity_m_s`` of the recording under test, (k,).
        reference: the same of the reference, (l,).
        period: of the excitation [s].

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

    Args:
        times: of the impacts on one flank, rising [s], (k,).
        period: of the excitation [s].

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
