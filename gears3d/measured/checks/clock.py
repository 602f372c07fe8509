"""Does time rise: rows given twice, clocks that wrap, rows out of order, stamps too coarse to tell rows apart."""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View, when

TICKS = (1.0, 1e-3, 1e-6, 1e-7, 1e-8, 1e-9)
"""Units that clocks count in [s]."""
ROUND = (60.0, 3600.0, 86400.0)
"""Where clocks for people start again [s]."""
BITS = range(8, 65)
LOCAL = 1000
"""Rows that are out of order by no more were written in blocks; further ones belong to another record."""


def examine(view: View) -> list[Finding]:
    """Find rows given twice and times that do not rise.

    Args:
        view: the record.
    """
    if np.all(view.time[1:] > view.time[:-1]):
        return []
    found = []
    twice = _twice(view.columns, view.used)
    columns = view.columns
    if 2 * np.count_nonzero(twice) > np.count_nonzero(np.diff(view.time) == 0.0):  # else the stamps are coarse
        rows = np.flatnonzero(twice)
        told = f"{len(rows)} rows repeat the row before with its time, at {when(view.time, rows)}"
        some = tuple(map(int, rows[:20]))
        found.append(Finding("duplicates", "time_s", float(len(rows)), "row", told, "", True, True, rows=some))
        columns = {name: values[~twice] for name, values in columns.items()}
    return found + _disorder(columns["time_s"])


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Leave repeated rows out, add wraps up, put rows into order, spread equal stamps evenly.

    Args:
        columns: each (n,).
        findings: of this check, of one kind.
    """
    kind, size = findings[0].kind, findings[0].size
    if kind == "duplicates":
        keep = ~_twice(columns, list(columns))
        return {name: values[keep] for name, values in columns.items()}
    time = columns["time_s"]
    if kind == "time-order":
        order = np.argsort(time, kind="stable")
        return {name: values[order] for name, values in columns.items()}
    if kind == "time-wrap":
        falls = np.concatenate([[0], np.cumsum(np.diff(time) < -0.5 * size)])
        return {**columns, "time_s": time + size * falls}
    return {**columns, "time_s": _even(time)}


def _twice(columns: dict[str, np.ndarray], names: list[str]) -> np.ndarray:
    """Return which rows are equal to the row before, (n,)."""
    same = np.zeros(len(columns["time_s"]), bool)
    same[1:] = np.diff(columns["time_s"]) == 0.0
    at = np.flatnonzero(same)
    for name in names:
        at = at[columns[name][at] == columns[name][at - 1]]
    same[:] = False
    same[at] = True
    return same


def _disorder(time: np.ndarray) -> list[Finding]:
    steps = np.diff(time)
    falls = np.flatnonzero(steps < 0.0) + 1
    rows = tuple(map(int, falls[:20]))
    if not falls.size or (found := _trembling(time, steps, rows)):
        return found if falls.size else _coarse(time, steps)
    rising = steps[steps > 0.0]
    step = float(np.median(rising)) if rising.size else 0.0
    if (wrap := _wrap(time, falls, step)) is not None:
        told = f"decreases by {wrap[0]:.9g} s, {wrap[1]}, {len(falls)} times, first in row {rows[0]}"
        return [Finding("time-wrap", "time_s", wrap[0], "s", told, "", True, True, rows=rows)]
    back = float(-steps.min())
    told = f"decreases {len(falls)} times, by at most {back:.6g} s, first in row {rows[0]} at {time[rows[0]]:.9g} s"
    order = np.argsort(time, kind="stable")
    ordered = np.diff(time[order])
    moved = int(np.abs(order - np.arange(len(order))).max())
    even = ordered.min() > 0.0 and np.mean(np.abs(ordered - np.median(ordered)) < 0.5 * np.median(ordered)) > 0.99
    if moved <= LOCAL and even:
        told += f"; sorted by time the rows are evenly spaced, the largest move is {moved}"
        return [Finding("time-order", "time_s", back, "s", told, "", True, True, rows=rows)]
    remedy = "split the file there: it probably contains several records"
    return [Finding("time-not-rising", "time_s", back, "s", told, remedy, True, rows=rows)]


def _wrap(time: np.ndarray, falls: np.ndarray, step: float) -> tuple[float, str] | None:
    """Return the span of a clock that starts again, and how it was known."""
    span = time[falls - 1] + step - time[falls]
    width = float(np.median(span))
    inside = float(time.max() - time.min()) <= width * (1.0 + 1e-9) + step
    if not inside or np.ptp(span) > 1.5 * step or width < 20.0 * step:
        return None
    for whole in ROUND:
        if abs(width - whole) < 1.5 * step:
            return whole, f"as of a clock that restarts after {whole:.0f} s"
    for tick in (*TICKS, step):
        for bits in BITS:
            if abs(width - tick * 2.0**bits) < 1.5 * step:
                return tick * 2.0**bits, f"2^{bits} ticks of {tick:.6g} s"
    return None


def _coarse(time: np.ndarray, steps: np.ndarray) -> list[Finding]:
    """Find stamps that stand still for some rows."""
    still = np.flatnonzero(steps <= 0.0) + 1
    if not still.size:
        return []
    tick = float(steps[steps > 0.0].min(initial=np.inf))
    off = float(np.abs(time - _even(time)).max())
    rows = tuple(map(int, still[:20]))
    told = f"{len(still)} rows have the time of the row before, but other angles, first row {rows[0]}"
    if np.isfinite(tick) and off < 1.5 * tick:
        told += f"; time stamps have a resolution of {tick:.6g} s and deviate from even spacing by at most {off:.3g} s"
        return [Finding("time-stamps", "time_s", tick, "s", told, "", True, True, rows=rows)]
    return [
        Finding(
            "time-not-rising",
            "time_s",
            float(len(still)),
            "row",
            told,
            "record time stamps with a finer resolution",
            True,
            rows=rows,
        )
    ]


def _trembling(time: np.ndarray, steps: np.ndarray, rows: tuple[int, ...]) -> list[Finding]:
    """Find stamps that tremble so much that neighbours change places, about an even line."""
    step = float(np.median(steps))
    if step <= 0.0 or -float(steps.min()) > step:
        return []
    off = time - _even(time)
    if float(np.abs(off).max()) > 2.0 * step:
        return []
    rms = float(np.std(off))
    told = f"time stamps have a jitter of {rms:.3g} s rms, {rms / step:.0%} of the sampling interval, so that some "
    told += f"decrease, first in row {rows[0]}"
    return [Finding("time-stamps", "time_s", rms, "s", told, "", True, True, rows=rows)]


def _even(time: np.ndarray) -> np.ndarray:
    """Return the straight line through the stamps, a row a step, [s], (n,)."""
    row = np.arange(len(time), dtype=float)
    slope, start = np.polyfit(row - row.mean(), time, 1)
    return start + slope * (row - row.mean())
