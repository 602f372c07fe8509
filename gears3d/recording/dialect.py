"""Dialect of a text file, found from its head: encoding, delimiter, decimal mark, header, units, time stamps."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta, timezone
from typing import NamedTuple

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
DAY = 86_400 * 10**9  # Nanoseconds of a day
NEVER = np.iinfo(np.int64).min  # A cell without a time, as numpy has NaT
EPOCHS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
FIRST, LAST = 1.0e9, 2.2e9  # Seconds since 1970 of September 2001 and of 2039: numbers between them may be epochs
LONGEST = 10.0  # Interval between two readings [s] beyond which a number is a counter and not an epoch
HEAD = 1 << 18  # Bytes from which the dialect is found
LINES = 400  # Lines from which it is found; a longer header hides the numbers
# What lines that are no rows begin with
COMMENTS = ("#", "%", "//", "!")
DELIMITERS = (";", "\t", ",", "|", " ")
# Cells of numbers that are not there
MISSING = (
    "",
    "nan",
    "NaN",
    "NAN",
    "-nan",
    "-NaN",
    "NA",
    "N/A",
    "n/a",
    "#N/A",
    "null",
    "NULL",
    "None",
    "-",
    "--",
    "---",
)
_UNITS = (
    "s ms us µs μs ns min h sec msec Sek rad mrad deg ° grad Grad degrees radians rev U Umdr turn turns rpm 1/min min-1"
    " min^-1 r/min U/min rev/min rad/s deg/s"
    " °/s rev/s 1/s Hz kHz MHz V mV A mA N kN Nm N·m mNm m mm um µm μm nm g m/s mm/s m/s^2 m/s² m/s2 rad/s^2 rad/s²"
    " °C degC K Pa kPa bar count counts cts inc incr ticks pulses samples - -- % 1"
)
_NUMBER = {
    ".": re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*|\s*[+-]?inf(inity)?\s*", re.IGNORECASE),
    ",": re.compile(r"\s*[+-]?(\d+(,\d+)?|,\d+)([eE][+-]?\d+)?\s*|\s*[+-]?inf(inity)?\s*", re.IGNORECASE),
}
_PLAIN = re.compile(r"[\s\d.,+-]*(?:\d[eE][+-]?\d+)?")
_LONG = re.compile(r"\s*\+?(\d{10,19})(?:[.,](\d+))?\s*")
LARGEST = 4e18  # Whole numbers that int64 holds, and as much again
END_OF_HEADER = "***End_of_Header***"  # Line of LabVIEW measurement files: names and rows stand below the last one
# Names of a last column that most rows leave out
COMMENTED = ("comment", "comments", "kommentar", "remark", "remarks", "bemerkung", "")
_WORD = re.compile(r"[^\s\[(]\S*(?:\s*(?:\[[^\[\]]*\]|\([^()]*\)))?|\[[^\[\]]*\]|\([^()]*\)")


def form_of(cell: str) -> str:
    """Return the form of a date or clock time, empty where a cell is neither.

    >>> form_of("2026-03-12T10:00:00.25Z"), form_of("12.03.2026 10:00:00,25"), form_of("10:00:00"), form_of("1.5")
    ('iso', 'dmy', 'clock', '')
    """
    if ":" not in cell:
        return ""
    return next((name for name, form in _FORMS.items() if form.fullmatch(cell)), "")


def form_of_column(cells: Sequence[str]) -> str:
    """Return the form of most cells of a column, empty where most are no times; 13/01 and 01/13 decide day and month.

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

    >>> epoch_unit(1.7e9, 0.001), epoch_unit(1.7e12, 1.0), epoch_unit(1.2e9, 200.0)
    ('s', 'ms', '')
    """
    fits = (unit for unit, size in EPOCHS.items() if FIRST < first / size < LAST and 0.0 <= step / size < LONGEST)
    return next(fits, "")


class Stamps:
    """Turns the cells of one column, block after block, into seconds since the first time.

    >>> Stamps("clock").seconds(["23:59:59.5", "", "00:00:00.25"]).tolist()
    [0.0, nan, 0.75]
    """

    def __init__(self, form: str) -> None:
        self._form = form
        self._first: int | None = None
        self._last = 0
        self._days = 0

    def seconds(self, cells: Sequence[str]) -> np.ndarray:
        """Return the next times [s], (n,), NaN where a cell holds none."""
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

    >>> Exact(6).since_first(np.array([1_700_000_000_000_001, 1_700_000_000_000_003])).tolist()
    [0.0, 2e-06]
    """

    def __init__(self, digits: int) -> None:
        self._first: int | None = None
        self._scale = 10.0**digits

    def since_first(self, whole: np.ndarray) -> np.ndarray:
        """Return the next distances, (n,), NaN where a number is missing."""
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


UNITS = frozenset([*_UNITS.split(), "", "N m"])  # Spellings by which a row of units is known
# Numbers whose thousands are separated
_GROUPED = {
    mark: re.compile(rf"\s*[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?:[{'.' if mark != '.' else ','}]\d+)?\s*")
    for mark in (",", ".", "'", "\u2019", "\xa0", "\u202f")
}


class Dialect(NamedTuple):
    """How a text file writes its table."""

    encoding: str  # name of the codec
    delimiter: str  # between cells; a space stands for any white space
    decimal: str  # ``"."`` or ``","``
    newline: str  # what ends a line
    skip: int  # lines above the first row of numbers
    names: tuple[str, ...]  # of the columns, as written; ``column 1`` and so on where the file has none
    units: tuple[str, ...]  # a row of them below the names, empty without one
    numeric: tuple[bool, ...]  # whether a column holds numbers or times
    header: tuple[str, ...]  # the lines above the names
    # of its times by column, ``exact N`` for numbers with N decimals that are counted from the first one
    forms: tuple[str, ...] = ()
    thousands: str = ""  # mark between groups of three digits, empty without one
    most: int = 0  # cells of the longest rows; those beyond the names are comments


class _Reading(NamedTuple):
    """One way to read the lines: score first, so that the greatest is the best.

    ``clean``: every cell of its rows is a number and the names fit, which no other way brings about by chance.
    """

    score: float
    clean: bool
    fits: bool
    width: int
    delimiter: str
    decimal: str
    first: int
    numeric: tuple[bool, ...]


def sniff(head: bytes, whole: bool = True) -> Dialect:
    r"""Return the dialect of a text file.

    >>> found = sniff("Prüfstand 3\nZeit;Winkel\n[s];[deg]\n0,0;1,5\n0,1;2,5\n".encode("latin-1"))
    >>> found.encoding, found.delimiter, found.decimal, found.skip, found.names, found.units
    ('cp1252', ';', ',', 3, ('Zeit', 'Winkel'), ('s', 'deg'))
    """
    encoding = _encoding(head)
    text = codecs.getincrementaldecoder(encoding)("replace").decode(head)
    newline = "\n" if "\n" in text or "\r" not in text else "\r"
    lines = [line.rstrip("\r") for line in text.split(newline)]
    lines = lines[:LINES] if whole or len(lines) > LINES else lines[:-1]
    written = lines
    ended = max((at for at, line in enumerate(lines) if line.startswith(END_OF_HEADER)), default=-1)
    lines = [""] * (ended + 1) + lines[ended + 1 :]
    thousands, found = "", _readings(lines)
    for mark, plain in _ungrouped(lines):
        if (other := _readings(plain)) and max(each.score for each in other) > max((e.score for e in found), default=0):
            thousands, found, lines = mark, other, plain
    if not found:
        raise ValueError("has no rows" if any(line.strip() for line in lines) else "is empty")
    most = max(each.score for each in found)
    best = max(found, key=lambda each: (each.clean and each.score >= 0.5 * most, each.score, each.fits, each.width))
    if not thousands and (mark := _hidden(lines, best)):
        thousands, best = mark, best._replace(decimal="." if mark == "," else ",")
    names, units, above, longest = _names(lines, best)
    while longest > best.width and best.first - 1 > above:  # rows with a comment behind the last column
        cells = split(lines[best.first - 1], best.delimiter)
        flags = [is_value(cell, best.decimal) for cell in cells]
        if not best.width < len(cells) <= longest or not _is_row(cells[: best.width], flags, best.numeric):
            break
        best = best._replace(first=best.first - 1)
    forms, units = _forms(lines, best, units)
    return Dialect(
        encoding,
        best.delimiter,
        best.decimal,
        newline,
        best.first,
        names,
        units,
        best.numeric,
        tuple(written[:above]),
        forms,
        thousands,
        longest,
    )


def ungrouped(text: str, mark: str) -> str:
    """Return text without the marks between groups of three digits.

    >>> ungrouped("1,234.5;12,345,678;1,2", ",")
    '1234.5;12345678;1,2'
    """
    return re.sub(rf"(?<=\d){re.escape(mark)}(?=\d{{3}}(?!\d))", "", text)


def _readings(lines: Sequence[str]) -> list[_Reading]:
    readings = [_read_as(lines, delimiter, decimal) for delimiter in DELIMITERS for decimal in (".", ",")]
    return [reading for reading in readings if reading is not None]


def _ungrouped(lines: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Return the lines without marks between thousands, for each mark that cannot be a separator of cells."""
    found = []
    whole = "\n".join(lines)
    for mark, form in _GROUPED.items():
        cells = [cell for cell in re.split(r'[;\t|"]|' + ("," if mark != "," else r"\n") + r"|\n", whole) if cell]
        if mark in whole and any(form.fullmatch(cell) for cell in cells):
            found.append((mark, ungrouped(whole, mark).split("\n")))
    return found


def _hidden(lines: Sequence[str], reading: _Reading) -> str:
    """Return the decimal mark where it parts thousands: three digits behind it always, and none in smaller numbers."""
    if reading.delimiter == "," or reading.decimal != ",":  # always three digits are common behind a point alone
        return ""
    rows = (split(line, reading.delimiter) for line in lines[reading.first :])
    rows = [row for row in rows if len(row) == reading.width]
    for k in range(reading.width):
        cells = [row[k] for row in rows if row[k]]
        grouped = [cell for cell in cells if reading.decimal in cell]
        whole = [cell for cell in cells if reading.decimal not in cell]
        form = _GROUPED[reading.decimal]
        if len(grouped) > 1 and len(whole) > 1 and all(form.fullmatch(cell) for cell in grouped):
            small = max((len(cell.strip("+- ")) for cell in whole if cell.strip("+- ").isdigit()), default=9)
            if small == 3:
                return reading.decimal
    return ""


def _forms(lines: Sequence[str], reading: _Reading, units: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return how the times of the columns are written, and the units of all columns."""
    rows = [split(line, reading.delimiter) for line in lines[reading.first :]]
    rows = [row for row in rows if len(row) >= reading.width]
    forms, known = [], list(units or ("",) * reading.width)
    for k in range(reading.width):
        cells = [row[k] for row in rows]
        form = form_of_column(cells)
        if not form and (told := _epoch(cells, reading.decimal)):
            form, unit = told
            known[k] = known[k] or unit
        elif form:
            known[k] = "s"
        forms.append(form)
    return tuple(forms), tuple(known) if any(known) else ()


def _epoch(cells: Sequence[str], decimal: str) -> tuple[str, str] | None:
    """Return form and unit of a column that counts time since 1970 in so many digits that a float would round."""
    if not cells or not any(_LONG.fullmatch(cell) for cell in cells[:1]):
        return None
    matches = [match for cell in cells if (match := _LONG.fullmatch(cell))]
    if len(matches) < 0.9 * len(cells) or any("." if decimal == "," else "," in cell for cell in cells):
        return None
    behind = max(len(match[2] or "") for match in matches)
    values = np.array([float(match[1]) + float("0." + (match[2] or "0")) for match in matches])
    steps = np.diff(values)
    if not len(steps) or np.mean(steps >= 0.0) < 0.9:
        return None
    unit = epoch_unit(float(values[0]), float(np.median(steps)))
    seconds = unit == "s" and behind == 0  # micros() of a controller passes 1e9, too
    fits = float(values[-1]) * 10.0**behind < LARGEST
    return (f"exact {behind}", unit) if unit and fits and not seconds else None


def split(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line.

    >>> split('"1,5",2', ","), split("  1   2", " ")
    (['1,5', '2'], ['1', '2'])
    """
    if delimiter == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return []


def is_number(cell: str, decimal: str) -> bool:
    """Return whether a cell is a number or one that is missing on purpose."""
    return _NUMBER[decimal].fullmatch(cell) is not None or (cell != "" and cell in MISSING)


def is_value(cell: str, decimal: str) -> bool:
    """Return whether a cell is a number or a time."""
    return is_number(cell, decimal) or form_of(cell) != ""


def _encoding(head: bytes) -> str:
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if head.startswith(mark):
            return name
    nulls = head[:4096].count(0)
    if nulls:
        sides = head[0:4096:2].count(0), head[1:4096:2].count(0)
        if max(sides) > 0.4 * len(head[:4096]) / 2 and min(sides) <= 0.1 * max(sides):
            return "utf-16-be" if sides[0] > sides[1] else "utf-16-le"
        raise ValueError("is not a text")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252" if not set(head) & {0x81, 0x8D, 0x8F, 0x90, 0x9D} else "latin-1"
    return "utf-8"


def _read_as(lines: Sequence[str], delimiter: str, decimal: str) -> _Reading | None:
    """Return how many lines are rows of numbers when they are read this way."""
    rows = {at: split(line, delimiter) for at, line in enumerate(lines) if line.strip() and not _is_comment(line)}
    numbers = {at: [is_value(cell, decimal) for cell in row] for at, row in rows.items()}
    alike = {at: sum(flags) for at, flags in numbers.items() if sum(flags) and _mostly(rows[at], flags)}
    best = None
    for width in dict.fromkeys(len(rows[at]) for at in alike):
        own = [at for at in rows if len(rows[at]) == width and at in alike]
        numeric = tuple(_numeric([rows[at][k] for at in own], decimal) for k in range(width))
        if not any(numeric):
            continue
        first = next((at for at in own if _is_row(rows[at], numbers[at], numeric)), None)
        if first is None:
            continue
        own = [at for at in own if at >= first]
        score = sum((alike[at] + rows[at].count("")) / width for at in own)
        above = [at for at in rows if at < first]
        fits = bool(above) and len(rows[above[-1]]) in (width, width - 1 if rows[own[0]][-1] == "" else width)
        clean = fits and width > 1 and score > len(own) - 1e-6
        reading = _Reading(float(score), clean, fits, width, delimiter, decimal, first, numeric)
        best = reading if best is None or (score, fits, width) > (best.score, best.fits, best.width) else best
    return best


def _is_row(row: list[str], flags: list[bool], numeric: tuple[bool, ...]) -> bool:
    """Return whether there is a number, and words in fewer than half of the columns that hold numbers."""
    words = sum(1 for k, cell in enumerate(row) if numeric[k] and cell and not flags[k])
    return 2 * words < sum(numeric) and any(flags[k] for k in range(len(row)) if numeric[k])


def _mostly(row: list[str], flags: list[bool]) -> bool:
    """Return whether words are fewer than half of the cells."""
    words = sum(1 for cell, flag in zip(row, flags, strict=True) if cell and not flag)
    return words < len(row) / 2 or (words == 1 and len(row) == 2)


def _numeric(cells: list[str], decimal: str) -> bool:
    given = [cell for cell in cells if cell]
    return bool(given) and 2 * sum(is_value(cell, decimal) for cell in given) >= len(given)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS)


def _names(lines: Sequence[str], reading: _Reading) -> tuple[tuple[str, ...], tuple[str, ...], int, int]:
    """Return the names, the units, the number of lines above both, and the cells of the line of names."""
    width = reading.width
    rows = [(at, cells) for at in range(reading.first) if (cells := _labels(lines[at], reading.delimiter, width))]
    plain = [(at, cells) for at, cells in rows if not _is_comment(lines[at])]
    if not plain and rows:  # names in the last comment, as numpy.savetxt writes them
        rows = [(at, [cells[0].lstrip("#%!/ "), *cells[1:]]) for at, cells in rows if at == reading.first - 1]
        plain = [(at, cells) for at, cells in rows if all(cells)]
    if not plain:
        return tuple(f"column {k + 1}" for k in range(width)), (), reading.first, width
    at, cells = plain[-1]
    units: tuple[str, ...] = ()
    if len(plain) > 1 and all(cell in UNITS or _bracketed(cell) for cell in cells):
        units = tuple(cell[1:-1] if _bracketed(cell) else cell.strip("-") for cell in cells)
        at, cells = plain[-2]
    names = tuple(cell or f"column {k + 1}" for k, cell in enumerate(cells))
    return names, units, at, max(width, len(split(lines[at], reading.delimiter)))


def _labels(line: str, delimiter: str, width: int) -> list[str] | None:
    """Return the cells of a line above the numbers, when there are as many as columns."""
    if not line.strip():
        return None
    cells = split(line, delimiter)
    if _is_comment(line) and delimiter == " ":
        cells = split(line.lstrip().lstrip("#%!/"), delimiter)
    if len(cells) == width - 1 and delimiter != " ":
        cells.append("")  # rows end with a separator that the names lack
    if len(cells) == width + 1 > 2 and cells[-1].lower() in COMMENTED:
        cells = cells[:-1]
    if len(cells) != width and delimiter == " ":
        wide = [part.strip() for part in re.split(r"\s{2,}|\t", line.strip())]
        cells = wide if len(wide) == width else [match.strip() for match in _WORD.findall(line)]
    words = any(cell and form is None for cell in cells for form in (_PLAIN.fullmatch(cell),))
    return cells if len(cells) == width and words else None


def _bracketed(cell: str) -> bool:
    return len(cell) > 1 and (cell[0], cell[-1]) in (("[", "]"), ("(", ")"))
