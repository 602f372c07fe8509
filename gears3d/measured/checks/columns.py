"""Is everything there: columns, rows, numbers."""

from __future__ import annotations

import numpy as np

from gears3d.errors import did_you_mean
from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View


def examine(view: View) -> list[Finding]:
    """Find columns that are missing, empty, of another length or no numbers, and rows that hold NaN or infinity.

    Args:
        view: the record.
    """
    found = [*_missing(view), *_shapes(view)]
    return found or _holes(view)


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Leave rows with NaN or infinity out.

    Args:
        columns: each (n,).
        findings: of this check.
    """
    names = {finding.channel for finding in findings}
    good = np.ones(len(columns["time_s"]), bool)
    for name in names:
        good &= np.isfinite(columns[name])
    return {name: values[good] for name, values in columns.items()}


def _missing(view: View) -> list[Finding]:
    found = []
    for need in ("time_s", *view.declared.needs):
        either = (need,) if isinstance(need, str) else need
        if not any(name in view.columns for name in either):
            have = list(view.columns)
            remedy = did_you_mean(either[0], have).replace("known:", "it has") if have else "the file has no columns"
            remedy += "; name the channels in record.toml" if have else ""
            told = f"column {' or '.join(either)} is missing"
            found.append(Finding("missing", either[0], 1.0, "column", told, remedy, fatal=True))
    return found


def _shapes(view: View) -> list[Finding]:
    found = []
    if "time_s" not in view.columns:
        return []
    rows = np.shape(view.time)[:1]
    for name in view.used:
        values = view.columns[name]
        if values.dtype.kind not in "biuf" and len(values):
            told = f"contains {values.flat[0]!r}, which is not a number"
            found.append(Finding("not-numbers", name, float(len(values)), "row", told, "write numbers", fatal=True))
        elif values.ndim != 1 or values.shape[:1] != rows:
            told = f"has shape {values.shape}, time_s has {rows[0] if rows else 0} rows"
            found.append(
                Finding("lengths", name, float(len(values)), "row", told, "give one value per row", fatal=True)
            )
    return found or empty(view)


def empty(view: View) -> list[Finding]:
    """Find too few rows to tell anything.

    Args:
        view: the record, corrected or not.
    """
    rows = len(view.time)
    if rows >= 3:
        return []
    remedy = "give a record with at least 3 rows"
    return [Finding("empty", "time_s", float(rows), "row", f"has {rows} rows", remedy, fatal=True)]


def _holes(view: View) -> list[Finding]:
    found = []
    for name in view.used:
        values = view.columns[name]
        if np.isfinite(values.sum()) or not (bad := np.flatnonzero(~np.isfinite(values))).size:
            continue
        told = f"{len(bad)} of {len(values)} rows are not finite numbers, the first is {values[bad[0]]} in row {bad[0]}"
        some = 2 * len(bad) < len(values)
        remedy = "" if some else "the channel was not recorded"
        rows = tuple(map(int, bad[:20]))
        found.append(Finding("not-finite", name, float(len(bad)), "row", told, remedy, True, some, rows=rows))
    return found
