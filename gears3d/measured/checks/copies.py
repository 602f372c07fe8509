"""Is the same record among the files twice: as it is, with another zero, another start, or in part."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import MESH
from gears3d.measured.readers import Channels

SNIPPET = 200
"""Rows that are looked for in the other record."""
FEWEST = 1000
"""Rows in common from which on two records overlap."""
SAME = 1e-9
"""Changes are the same when they differ by no more [rad]."""


def examine(channels: Channels, others: Iterable[Channels]) -> list[Finding]:
    """Find records among others that hold the same readings.

    Args:
        channels: the record.
        others: records given before.

    >>> rows = np.random.default_rng(1).normal(size=5000)
    >>> one = Channels({"time_s": np.arange(5000.0), "theta_loose_rad": rows}, "a.csv")
    >>> late = Channels({"time_s": np.arange(5000.0) + 7.0, "theta_loose_rad": rows + 1.0}, "b.csv")
    >>> [finding.kind for finding in examine(late, [one])], examine(one, [])
    (['duplicated-file'], [])
    """
    found = []
    for other in others:
        common = _common(channels.columns, other.columns)
        if common is None:
            continue
        rows, late = common
        whole = rows == len(channels.columns["time_s"])
        told = f"{'all' if whole else rows} of its rows are identical to those of {other.file or 'an earlier file'}"
        told += f", {late:.9g} s later" if late else ""
        remedy = "name each record once: repeated records make all confidence intervals too narrow"
        found.append(Finding("duplicated-file", "", float(rows), "row", told, remedy, True, True))
    return found


def _common(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> tuple[int, float] | None:
    """Return how many rows are the same and how much later they are in the first."""
    names = [name for name in MESH if name in one and name in other] or sorted((one.keys() & other.keys()) - {"time_s"})
    if not names or "time_s" not in one or "time_s" not in other:
        return None
    mine, its = ([np.diff(columns[name]) for name in names] for columns in (one, other))
    for shift in _shifts(mine[-1], its[-1]):
        first, last = max(-shift, 0), min(len(mine[0]), len(its[0]) - shift)
        if last - first + 1 < min(FEWEST, len(one["time_s"])):
            continue
        same = (a[first:last] - b[first + shift : last + shift] for a, b in zip(mine, its, strict=True))
        if all(np.abs(off).max(initial=0.0) < SAME for off in same):
            return last - first + 1, float(one["time_s"][first] - other["time_s"][first + shift])
    return None


def _shifts(mine: np.ndarray, its: np.ndarray) -> list[int]:
    """Return by how many rows a snippet of one lies elsewhere in the other."""
    shifts = [0]
    for part in (0.1, 0.5, 0.9):
        start = int(part * max(len(mine) - SNIPPET, 0))
        snippet = mine[start : start + SNIPPET]
        if len(snippet) < 20 or len(its) < len(snippet) or not np.abs(snippet).max() > SAME:
            continue
        at = np.arange(len(its) - len(snippet) + 1)
        for k in np.argsort(-np.abs(snippet - np.median(snippet)), kind="stable"):
            at = at[np.abs(its[at + k] - snippet[k]) < SAME]
            if len(at) < 2:
                break
        shifts += [int(found) - start for found in at[:3]]
    return list(dict.fromkeys(shifts))
