"""Completeness: columns, rows, numbers, notes of decoders, records given twice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gears3d.errors import did_you_mean
from gears3d.measured.checks.view import MESH, Finding, View
from gears3d.measured.readers import Channels

DROPPED = "drop-outs"
# Rows without a reading that are excluded without a request, at most.
FEW = 20
# Part of the rows that they may be, as of damaged rows; only the flights that they interrupt are lost.
SHARE = 0.01
# Rows in a row that they may be.
LONGEST = 2
# Ratio of the distance from zero to the motion of neighbouring readings, from which a zero is a missing reading.
FAR = 10.0
# Angle [rad] that no gear reaches: ten years at 30 000 rpm.
FARTHEST = 1e12


def examine(view: View) -> list[Finding]:
    """Find columns that are missing, empty, of another length or no numbers, and rows that hold NaN or infinity."""
    found = [*_missing(view), *_shapes(view)]
    return found or _holes(view)


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Exclude rows without a reading: NaN, infinity, or a zero far from the readings around it."""
    good = np.ones(len(columns["time_s"]), bool)
    for finding in findings:
        values = columns[finding.channel]
        good &= np.isfinite(values)
        if finding.kind == DROPPED:
            good[_zeros(values)] = False
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
    """Find records with too few rows."""
    rows = len(view.time)
    if rows >= 3:
        return []
    remedy = "give a record with at least 3 rows"
    return [Finding("empty", "time_s", float(rows), "row", f"has {rows} rows", remedy, fatal=True)]


def _holes(view: View) -> list[Finding]:
    found = []
    for name in view.used:
        values = view.columns[name]
        if not np.isfinite(values.sum()) and (bad := np.flatnonzero(~np.isfinite(values))).size:
            some = tuple(map(int, bad[:20]))
            told = f"{len(bad)} of {len(values)} rows are not finite numbers, "
            told += f"the first is {values[bad[0]]} in row {bad[0]}"
            if name in MESH and _few(bad, len(values)):
                found.append(_dropped(name, bad, told))
                continue
            part = 2 * len(bad) < len(values)
            remedy = "" if part else "the channel was not recorded"
            found.append(Finding("not-finite", name, float(len(bad)), "row", told, remedy, True, part, rows=some))
        elif name in MESH and (far := float(np.max(np.abs(values), initial=0.0))) > FARTHEST:
            told = f"goes to {far:.3g} rad, {far / (2.0 * np.pi):.3g} revolutions: no angle of a gear"
            found.append(Finding("too-large", name, far, "rad", told, "correct the unit or the decoder", True))
        elif name in MESH and (bad := _zeros(values)).size:
            told = (
                f"{len(bad)} of {len(values)} rows are zero although the rows around them are not, first row {bad[0]}"
            )
            found.append(_dropped(name, bad, told, not _few(bad, len(values))))
    return found


def _dropped(name: str, rows: np.ndarray, told: str, fatal: bool = False) -> Finding:
    some = tuple(map(int, rows[:20]))
    remedy = "check for poor electrical contact or interference"
    return Finding(DROPPED, name, float(len(rows)), "row", told, remedy, fatal, True, rows=some)


def _few(rows: np.ndarray, total: int) -> bool:
    """Return whether rows are few and single, so that their loss can be neglected."""
    if len(rows) > FEW or len(rows) > SHARE * total:
        return False
    return not bool(np.any(rows[LONGEST:] - rows[:-LONGEST] == LONGEST))


def _zeros(values: np.ndarray) -> np.ndarray:
    """Return single rows that are exactly zero, while the readings before and after agree far from zero."""
    at = np.flatnonzero(values == 0.0)
    if not at.size or 10 * len(at) > len(values):
        return at[:0]
    sound = np.flatnonzero(np.isfinite(values) & (values != 0.0))
    after = np.searchsorted(sound, at)
    inside = (after >= 2) & (after < len(sound) - 1)
    at, after = at[inside], after[inside]
    one, other = values[sound[after - 1]], values[sound[after]]
    step = np.abs(one - values[sound[after - 2]]) + np.abs(values[sound[after + 1]] - other)
    near = sound[after] - sound[after - 1] - 1 <= LONGEST
    away = np.minimum(np.abs(one), np.abs(other)) > FAR * (np.abs(other - one) + step)
    return at[near & away & (one * other > 0.0)]


REMEDIES = {
    "illegal-transitions": "sample faster, or check thresholds and cables",
    "lost-counts": "check thresholds and cables: counts between index marks differ",
    "lost-pulses": "check the threshold of the tacho",
    "large-steps": "sample faster, or use a counter with more bits",
    "drift": "record an angle: an integrated speed drifts",
}


def examine_decoded(meta: Mapping[str, Any]) -> list[Finding]:
    """Find what a decoder noted that is wrong with a channel.

    >>> note = {"kind": "lost-pulses", "channel": "T", "size": 2.0, "unit": "", "text": "2 missing", "harmless": False}
    >>> [(one.kind, one.channel, one.size) for one in examine_decoded({"decoded": [note, {**note, "harmless": True}]})]
    [('lost-pulses', 'T', 2.0)]
    """
    notes = meta.get("decoded", [])
    return [
        Finding(
            str(note["kind"]),
            str(note.get("channel", "")),
            float(note.get("size", 0.0)),
            str(note.get("unit", "")) or "1",
            str(note.get("text", "")),
            REMEDIES.get(note["kind"], ""),
        )
        for note in (notes if isinstance(notes, list) else [])
        if isinstance(note, Mapping) and note.get("kind") and not note.get("harmless", True)
    ]


# Rows that are looked for in the other record.
SNIPPET = 200
# Rows in common from which on two records overlap.
FEWEST = 1000
# Changes are the same when they differ by no more [rad].
SAME = 1e-9


def examine_copies(channels: Channels, others: Iterable[Channels]) -> list[Finding]:
    """Find records among others that hold the same readings.

    >>> rows = np.random.default_rng(1).normal(size=5000)
    >>> one = Channels({"time_s": np.arange(5000.0), "theta_loose_rad": rows}, "a.csv")
    >>> late = Channels({"time_s": np.arange(5000.0) + 7.0, "theta_loose_rad": rows + 1.0}, "b.csv")
    >>> [finding.kind for finding in examine_copies(late, [one])], examine_copies(one, [])
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
