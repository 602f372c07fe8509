"""Dates, clock times and epochs in cells of text as seconds since the first one; subtracted before they are rounded."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta, timezone

import numpy as np

_CLOCK = (
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:[.,](?P<part>\d+))?(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
)
_ZONE = r"\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
_FORMS = {
    "iso": re.compile(rf"(?P<year>\d{{4}})[-/.](?P<month>\d{{1,2}})[-/.](?P<day>\d{{1,2}})(?:T|\s+){_CLOCK}{_ZONE}"),
    "dmy": re.compile(rf"(?P<day>\d{{1,2}})[-/.](?P<month>\d{{1,2}})[-/.](?P<year>\d{{4}}),?\s+{_CLOCK}{_ZONE}"),
    "mdy": re.compile(rf"(?P<month>\d{{1,2}})/(?P<day>\d{{1,2}})/(?P<year>\d{{4}}),?\s+{_CLOCK}{_ZONE}"),
    "clock": re.compile(_CLOCK),
}
DAY = 86_400 * 10**9
"""Nanoseconds of a day."""
NEVER = np.iinfo(np.int64).min
"""A cell without a time, as numpy has NaT."""
EPOCHS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
FIRST, LAST = 1.0e9, 2.2e9
"""Seconds since 1970 of September 2001 and of 2039: numbers between them may be epochs."""
LONGEST = 10.0
"""Interval between two readings [s] beyond which a number is no epoch but a counter."""


def form_of(cell: str) -> str:
    """Return the form of a date or clock time, empty where a cell is none.

    Args:
        cell: of a table.

    >>> form_of("2026-03-12T10:00:00.25Z"), form_of("12.03.2026 10:00:00,25"), form_of("10:00:00"), form_of("1.5")
    ('iso', 'dmy', 'clock', '')
    """
    if ":" not in cell:
        return ""
    return next((name for name, form in _FORMS.items() if form.fullmatch(cell)), "")


def form_of_column(cells: Sequence[str]) -> str:
    """Return the form of most cells of a column, empty where most are no times; 13/01 and 01/13 decide day and month.

    Args:
        cells: of a column.

    >>> form_of_column(["1/12/2026 10:00:00", "1/13/2026 10:00:00"]), form_of_column(["1", "2", "10:00:00"])
    ('mdy', '')
    """
    forms = [form_of(cell) for cell in cells if cell]
    known = [form for form in forms if form]
    if not known or 2 * len(known) < len(forms):
        return ""
    form = max(set(known), key=known.count)
    if form == "dmy" and all(_FORMS["mdy"].fullmatch(cell) for cell in cells if form_of(cell) == "dmy"):
        months = [int(re.split(r"[-/.]", cell)[1]) for cell in cells if form_of(cell) == "dmy"]
        return "mdy" if max(months) > 12 or "M" in "".join(cells).upper() else "dmy"
    return form


def epoch_unit(first: float, step: float) -> str:
    """Return the unit in which a number counts time since 1970, empty where it does not.

    Args:
        first: reading.
        step: between two readings, in the same unit.

    >>> epoch_unit(1.7e9, 0.001), epoch_unit(1.7e12, 1.0), epoch_unit(1.2e9, 200.0)
    ('s', 'ms', '')
    """
    fits = (unit for unit, size in EPOCHS.items() if FIRST < first / size < LAST and 0.0 <= step / size < LONGEST)
    return next(fits, "")


class Stamps:
    """Turns the cells of one column, block after block, into seconds since the first time.

    Args:
        form: of the cells, as :func:`form_of_column` returns it.

    >>> Stamps("clock").seconds(["23:59:59.5", "", "00:00:00.25"]).tolist()
    [0.0, nan, 0.75]
    """

    def __init__(self, form: str) -> None:
        self._form = form
        self._first: int | None = None
        self._last = 0
        self._days = 0

    def seconds(self, cells: Sequence[str]) -> np.ndarray:
        """Return the next times [s], (n,), NaN where a cell holds none.

        Args:
            cells: of the column.
        """
        stamps = _nanoseconds(cells, self._form)
        known = stamps != NEVER
        if not known.any():
            return np.full(len(stamps), np.nan)
        times = stamps[known]
        if self._form == "clock":
            last = self._last if self._first is not None else int(times[0])
            turns = np.diff(times, prepend=last) < -DAY // 2
            back = np.diff(times, prepend=last) > DAY // 2
            self._last = int(times[-1])
            days = self._days + np.cumsum(turns.astype(np.int64) - back)
            self._days = int(days[-1])
            times = times + DAY * days
        if self._first is None:
            self._first = int(times[0])
        found = np.full(len(stamps), np.nan)
        found[known] = (times - self._first) / 1e9
        return found


class Exact:
    """Turns long numbers, scaled to whole ones, into their distance from the first one.

    Args:
        digits: decimal digits behind the point.

    >>> Exact(6).since_first(np.array([1_700_000_000_000_001, 1_700_000_000_000_003])).tolist()
    [0.0, 2e-06]
    """

    def __init__(self, digits: int) -> None:
        self._first: int | None = None
        self._scale = 10.0**digits

    def since_first(self, whole: np.ndarray) -> np.ndarray:
        """Return the next distances, (n,), NaN where there is no number.

        Args:
            whole: numbers times ten to the digits, int64; ``NEVER`` where there is none.
        """
        known = whole != NEVER
        if self._first is None and known.any():
            self._first = int(whole[known][0])
        return np.where(known, (whole - np.int64(self._first or 0)) / self._scale, np.nan)


def _nanoseconds(cells: Sequence[str], form: str) -> np.ndarray:
    """Return times as whole nanoseconds, (n,)."""
    if form == "iso" and not any(set(cell[11:]) & set("+-UGMmAaPp") or len(cell) < 16 for cell in cells):
        plain = np.char.replace(np.char.replace(np.asarray(cells, dtype=str), ",", "."), "/", "-")
        try:
            stamps = np.char.rstrip(plain, "Z").astype("datetime64[ns]")
            return stamps.astype(np.int64)
        except ValueError:
            pass
    return np.array([_one(cell, form) for cell in cells], dtype=np.int64)


def _one(cell: str, form: str) -> int:
    match = _FORMS[form].fullmatch(cell)
    if match is None:
        return NEVER
    told = match.groupdict()
    hour, minute, second = (int(told[name]) for name in ("hour", "minute", "second"))
    if told["half"]:
        hour = hour % 12 + 12 * (told["half"] in "Pp")
    part = int((told["part"] or "")[:9].ljust(9, "0"))
    own = ((hour * 60 + minute) * 60 + second) * 10**9 + part
    if form == "clock":
        return own
    zone = UTC
    if (text := told["zone"] or "")[:1] in ("+", "-"):
        hours, minutes = int(text[1:3]), int(text[-2:])
        zone = timezone((-1 if text[0] == "-" else 1) * timedelta(hours=min(hours, 23), minutes=min(minutes, 59)))
    try:
        day = datetime(int(told["year"]), int(told["month"]), int(told["day"]), tzinfo=zone)
    except ValueError:
        return NEVER
    total = int(day.timestamp()) * 10**9 + own
    return total if abs(total) < np.iinfo(np.int64).max else NEVER
