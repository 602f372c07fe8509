"""How a text file writes its table: encoding, separator, decimal point, where names end and numbers begin."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

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
    "s ms us µs μs ns min h rad mrad deg ° grad rev U turn turns rpm 1/min min-1 min^-1 r/min U/min rev/min rad/s deg/s"
    " °/s rev/s 1/s Hz kHz MHz V mV A mA N kN Nm N·m mNm m mm um µm μm nm g m/s mm/s m/s^2 m/s² m/s2 rad/s^2 rad/s²"
    " °C degC K Pa kPa bar count counts cts inc incr ticks pulses samples - -- % 1"
)
UNITS = frozenset([*_UNITS.split(), "", "N m"])
"""Spellings by which a row of units is known."""
_NUMBER = {
    ".": re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*|\s*[+-]?inf(inity)?\s*", re.IGNORECASE),
    ",": re.compile(r"\s*[+-]?(\d+(,\d+)?|,\d+)([eE][+-]?\d+)?\s*|\s*[+-]?inf(inity)?\s*", re.IGNORECASE),
}
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
        numeric: whether a column holds numbers.
        header: the lines above the names.
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
    readings = [_read_as(lines, delimiter, decimal) for delimiter in DELIMITERS for decimal in (".", ",")]
    found = [reading for reading in readings if reading is not None]
    if not found:
        raise ValueError("has no rows" if any(line.strip() for line in lines) else "is empty")
    most = max(each.score for each in found)
    best = max(found, key=lambda each: (each.clean and each.score >= 0.5 * most, each.score, each.fits, each.width))
    names, units, above = _names(lines, best)
    return Dialect(
        encoding, best.delimiter, best.decimal, newline, best.first, names, units, best.numeric, tuple(lines[:above])
    )


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
    numbers = {at: [is_number(cell, decimal) for cell in row] for at, row in rows.items()}
    alike = {at: sum(flags) for at, flags in numbers.items() if sum(flags) and _mostly(rows[at], flags)}
    scores: Counter[int] = Counter()
    for at in alike:
        row = rows[at]
        scores[len(row)] += (alike[at] + row.count("")) / len(row)  # type: ignore[assignment]
    best = None
    for width, score in scores.items():
        own = [at for at in rows if len(rows[at]) == width and at in alike]
        numeric = tuple(_numeric([rows[at][k] for at in own], decimal) for k in range(width))
        if not any(numeric):
            continue
        first = next((at for at in own if _is_row(rows[at], numbers[at], numeric)), None)
        if first is None:
            continue
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
    return bool(given) and 2 * sum(is_number(cell, decimal) for cell in given) >= len(given)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS)


def _names(lines: Sequence[str], reading: _Reading) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return the names, the units and the number of lines above both."""
    width = reading.width
    rows = [(at, cells) for at in range(reading.first) if (cells := _labels(lines[at], reading.delimiter, width))]
    plain = [(at, cells) for at, cells in rows if not _is_comment(lines[at])]
    if not plain:  # names in the last comment, as numpy.savetxt writes them
        rows = [(at, [cells[0].lstrip("#%!/ "), *cells[1:]]) for at, cells in rows if at == reading.first - 1]
        plain = [(at, cells) for at, cells in rows if all(cells)]
    if not plain:
        return tuple(f"column {k + 1}" for k in range(width)), (), reading.first
    at, cells = plain[-1]
    units: tuple[str, ...] = ()
    if len(plain) > 1 and all(cell in UNITS or _bracketed(cell) for cell in cells):
        units = tuple(cell[1:-1] if _bracketed(cell) else cell.strip("-") for cell in cells)
        at, cells = plain[-2]
    names = tuple(cell or f"column {k + 1}" for k, cell in enumerate(cells))
    return names, units, at


def _labels(line: str, delimiter: str, width: int) -> list[str] | None:
    """Return the cells of a line above the numbers, when there are as many as columns."""
    if not line.strip():
        return None
    cells = split(line, delimiter)
    if _is_comment(line) and delimiter == " ":
        cells = split(line.lstrip().lstrip("#%!/"), delimiter)
    if len(cells) == width - 1 and delimiter != " ":
        cells.append("")  # rows end with a separator that the names lack
    if len(cells) != width and delimiter == " ":
        wide = [part.strip() for part in re.split(r"\s{2,}|\t", line.strip())]
        cells = wide if len(wide) == width else [match.strip() for match in _WORD.findall(line)]
    return cells if len(cells) == width and any(cells) else None


def _bracketed(cell: str) -> bool:
    return len(cell) > 1 and (cell[0], cell[-1]) in (("[", "]"), ("(", ")"))
