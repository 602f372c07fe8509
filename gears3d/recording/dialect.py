"""How a text file writes its table: encoding, separator, decimal point, where names end and numbers begin."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.recording.stamps import epoch_unit, form_of, form_of_column

HEAD = 1 << 18
"""Bytes from which the dialect is told."""
LINES = 400
"""Lines from which it is told; a longer header hides the numbers."""
COMMENTS = ("#", "%", "//", "!")
"""What lines that are no rows begin with."""
DELIMITERS = (";", "\t", ",", "|", " ")
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
"""Cells of numbers that are not there."""
_UNITS = (
    "s ms us µs μs ns min h sec msec Sek rad mrad deg ° grad Grad degrees radians rev U Umdr turn turns rpm 1/min min-1"
    " min^-1 r/min U/min rev/min rad/s deg/s"
    " °/s rev/s 1/s Hz kHz MHz V mV A mA N kN Nm N·m mNm m mm um µm μm nm g m/s mm/s m/s^2 m/s² m/s2 rad/s^2 rad/s²"
    " °C degC K Pa kPa bar count counts cts inc incr ticks pulses samples - -- % 1"
)
UNITS = frozenset([*_UNITS.split(), "", "N m"])
"""Spellings by which a row of units is known."""
_NUMBER = {
    ".": re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*|\s*[+-]?inf(inity)?\s*", re.IGNORECASE),
    ",": re.compile(r"\s*[+-]?(\d+(,\d+)?|,\d+)([eE][+-]?\d+)?\s*|\s*[+-]?inf(inity)?\s*", re.IGNORECASE),
}
_GROUPED = {
    mark: re.compile(rf"\s*[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?:[{'.' if mark != '.' else ','}]\d+)?\s*")
    for mark in (",", ".", "'", "\u2019", "\xa0", "\u202f")
}
"""Numbers whose thousands are separated."""
_PLAIN = re.compile(r"[\s\d.,+-]*(?:\d[eE][+-]?\d+)?")
_LONG = re.compile(r"\s*\+?(\d{10,19})(?:[.,](\d+))?\s*")
LARGEST = 4e18
"""Whole numbers that int64 holds, and as much again."""
END_OF_HEADER = "***End_of_Header***"
"""Line of LabVIEW measurement files: names and rows stand below the last one."""
COMMENTED = ("comment", "comments", "kommentar", "remark", "remarks", "bemerkung", "")
"""Names of a last column that most rows leave out."""
_WORD = re.compile(r"[^\s\[(]\S*(?:\s*(?:\[[^\[\]]*\]|\([^()]*\)))?|\[[^\[\]]*\]|\([^()]*\)")


class Dialect(NamedTuple):
    """How a text file writes its table.

    Args:
        encoding: name of the codec.
        delimiter: between cells; a space stands for any white space.
        decimal: ``"."`` or ``","``.
        newline: what ends a line.
        skip: lines above the first row of numbers.
        names: of the columns, as written; ``column 1`` and so on where the file has none.
        units: a row of them below the names, empty where there is none.
        numeric: whether a column holds numbers or times.
        header: the lines above the names.
        forms: of its times by column, ``exact N`` for numbers with N decimals that are counted from the first one.
        thousands: mark between groups of three digits, empty where there is none.
        most: cells of the longest rows; those beyond the names are comments.
    """

    encoding: str
    delimiter: str
    decimal: str
    newline: str
    skip: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    numeric: tuple[bool, ...]
    header: tuple[str, ...]
    forms: tuple[str, ...] = ()
    thousands: str = ""
    most: int = 0


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

    Args:
        head: its first bytes.
        whole: whether they are all; else the last line is left out, which may be cut.

    Returns:
        The dialect in which most lines are rows of numbers.

    Raises:
        ValueError: it is no text, or holds no row with a number; says which.

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

    Args:
        text: rows.
        mark: that is taken out.

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

    Args:
        line: without its end.
        delimiter: a space stands for any white space.

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
    """Return whether a cell is a number or one that is missing on purpose.

    Args:
        cell: its text; an empty one is no number.
        decimal: the decimal mark.
    """
    return _NUMBER[decimal].fullmatch(cell) is not None or (cell != "" and cell in MISSING)


def is_value(cell: str, decimal: str) -> bool:
    """Return whether a cell is a number or a time.

    Args:
        cell: its text; an empty one is no value.
        decimal: the decimal mark.
    """
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
        raise ValueError("is no text")
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
