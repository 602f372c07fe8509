"""Rows of a text file as columns of numbers, in blocks; what is not a number is located by its line."""

from __future__ import annotations

import codecs
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.inputs import refuse_beyond, refuse_special
from gears3d.recording.columns import SIGNAL_UNITS, floats_of
from gears3d.recording.dialect import (
    COMMENTS,
    HEAD,
    MISSING,
    NEVER,
    Dialect,
    Exact,
    Stamps,
    form_of,
    is_number,
    sniff,
    split,
    ungrouped,
)

SHOWN = 5  # Rows that a message names
BLOCK = 1 << 18  # Bytes read at a time
LINE = 1 << 20  # Bytes of a line
MOST = 0.01  # Share of damaged rows beyond which a file is refused: so many are no accident, the dialect is another one
SOME = 1000  # Damaged rows that are read in any case before the share is known
REMEDY = "a line of column names, then numbers, separated by commas"
_SINGLE = ("utf-8", "utf-8-sig", "cp1252", "latin-1")


class TooMuchError(Exception):
    """A file has more damaged rows than may be left out."""


@dataclass
class Torn:
    """Which rows of a table were damaged; rows count from 1 below the names."""

    # indices of rows that hold NaN because their cells are too few or too many
    gaps: list[int] = field(default_factory=list)
    # such rows, those that were left out at the beginning and at the end among them
    rows: list[int] = field(default_factory=list)
    # rows without any number, left out: repeated names, messages of a logger
    words: list[int] = field(default_factory=list)
    # column and row of single cells that are no number, NaN
    cells: list[tuple[str, int]] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.rows or self.words or self.cells)

    def refuse_beyond(self, most: float) -> None:
        """Refuse more damage than may be left out; a row that was cut at either end counts for nothing."""
        count = len(self.gaps) + len(self.words) + len(self.cells)
        if count > most:
            raise TooMuchError(f"{count} rows are damaged, at most 1 % may be left out")

    def without_last(self, count: int) -> int:
        """Leave out a damaged last row and return the number of rows."""
        while self.gaps and self.gaps[-1] == count - 1:
            self.gaps.pop()
            count -= 1
        return count

    def told(self) -> list[tuple[str, int, str]]:
        """Return what happened: a kind, a number of rows, and a sentence."""
        found = []
        if self.rows:
            what = f"{len(self.rows)} rows have too few or too many cells and are excluded: {_shown(self.rows)}"
            found.append(("torn-rows", len(self.rows), what))
        if self.words:
            what = f"{len(self.words)} rows hold no number and are excluded: {_shown(self.words)}"
            found.append(("rows-of-words", len(self.words), what))
        if self.cells:
            where = ", ".join(f"{name} row {row}" for name, row in self.cells[:SHOWN])
            more = f" and {len(self.cells) - SHOWN} more" if len(self.cells) > SHOWN else ""
            found.append(("no-numbers", len(self.cells), f"{len(self.cells)} cells hold no number: {where}{more}"))
        return found


class Columns:
    """Turns the blocks of a table into columns, one block after the other."""

    def __init__(self, dialect: Dialect, places: Sequence[int], torn: Torn) -> None:
        self._dialect, self._places, self._torn = dialect, places, torn
        forms = dialect.forms or ("",) * len(dialect.names)
        self._exact = {place: int(forms[place].split()[1]) for place in places if forms[place].startswith("exact")}
        counters = {place: Exact(digits) for place, digits in self._exact.items()}
        stamps = {place: Stamps(forms[place]) for place in places if forms[place] and place not in counters}
        self._counters, self._stamps = counters, stamps

    def of(self, block: bytes, done: int) -> list[np.ndarray]:
        """Return the columns of a block, each (n,)."""
        import pyarrow as pa

        if not block.strip():
            return [np.zeros(0)] * len(self._places)
        try:
            return self._fast(block)
        except pa.ArrowException:
            return self._slow(block, done)

    def _fast(self, block: bytes) -> list[np.ndarray]:
        import pyarrow as pa
        from pyarrow import csv

        types: dict[str, Any] = {f"c{place}": pa.float64() for place in self._places}
        types |= {f"c{place}": pa.string() for place in self._stamps}
        types |= {f"c{place}": pa.decimal128(38, digits) for place, digits in self._exact.items()}
        dialect = self._dialect
        found = csv.read_csv(
            pa.BufferReader(block),
            read_options=csv.ReadOptions(
                use_threads=False, block_size=len(block) + 1, column_names=[f"c{k}" for k in range(len(dialect.names))]
            ),
            parse_options=csv.ParseOptions(delimiter=dialect.delimiter),
            convert_options=csv.ConvertOptions(
                include_columns=[f"c{place}" for place in self._places],
                column_types=types,
                null_values=list(MISSING),
                decimal_point=dialect.decimal,
                strings_can_be_null=False,
            ),
        )
        columns = [found.column(k).combine_chunks() for k in range(len(self._places))]
        return [self._values(place, column) for place, column in zip(self._places, columns, strict=True)]

    def _values(self, place: int, column: Any) -> np.ndarray:
        """Return a column of pyarrow as float64."""
        if place in self._stamps:
            return self._stamps[place].seconds([cell or "" for cell in column.to_pylist()])
        if place not in self._exact:
            return floats_of(column)
        known = np.array(column.is_valid())
        words = np.frombuffer(column.buffers()[1], np.int64, 2 * len(column), 16 * column.offset)[::2]
        return self._counters[place].since_first(np.where(known, words, NEVER))

    def _slow(self, block: bytes, done: int) -> list[np.ndarray]:
        """Return the columns of a block with damaged rows."""
        dialect, torn = self._dialect, self._torn
        width, most = len(dialect.names), max(dialect.most, len(dialect.names))
        rows: list[list[str] | None] = []
        numbers: list[int] = []
        left = len(torn.rows) + len(torn.words) - len(torn.gaps)  # rows before this block that are not in the arrays
        for line in block.decode("utf-8", "replace").split("\n"):
            if not line.strip():
                continue
            number = done + left + len(rows) + 1
            cells = split(line.rstrip("\r"), dialect.delimiter)
            given = [cell for place, cell in enumerate(cells) if place < width and dialect.numeric[place] and cell]
            if given and not any(is_number(cell, dialect.decimal) or ":" in cell for cell in given):
                torn.words.append(number)
                left += 1
            elif width <= len(cells) <= most or (len(cells) > width and not any(cells[width:])):
                rows.append(cells)
                numbers.append(number)
            elif not rows and not done:  # a logger that was joined within a row
                torn.rows.append(number)
                left += 1
            else:
                torn.rows.append(number)
                torn.gaps.append(done + len(rows))
                rows.append(None)
                numbers.append(number)
        return [self._cells(place, rows, numbers) for place in self._places]

    def _cells(self, place: int, rows: list[list[str] | None], numbers: list[int]) -> np.ndarray:
        """Return a column of rows as float64, NaN where a row is damaged or a cell no number."""
        cells = ["" if row is None else row[place] for row in rows]
        if place in self._stamps:
            return self._stamps[place].seconds(cells)
        decimal = self._dialect.decimal
        found = np.full(len(cells), np.nan)
        whole = np.full(len(cells), NEVER)
        for at, cell in enumerate(cells):
            if cell in MISSING:
                continue
            if not is_number(cell, decimal):
                self._torn.cells.append((self._dialect.names[place], numbers[at]))
            elif place in self._exact:
                digits = self._exact[place]
                head, _, tail = cell.replace(decimal, ".").partition(".")
                if head.isdigit() and (not tail or tail.isdigit()) and len(head) + digits <= 19:
                    whole[at] = min(int(head) * 10**digits + int((tail + "0" * digits)[:digits] or "0"), -NEVER - 1)
            else:
                found[at] = float(cell.replace(decimal, "."))
        return self._counters[place].since_first(whole) if place in self._exact else found


def _shown(rows: list[int]) -> str:
    """Return the first numbers of rows as one phrase."""
    names = ", ".join(map(str, rows[:SHOWN]))
    more = f" and {len(rows) - SHOWN} more" if len(rows) > SHOWN else ""
    return f"row{'s' if len(rows) > 1 else ''} {names}{more}"


@dataclass(frozen=True)
class TextTable:
    """A table in a text file, of which nothing but the head is read yet."""

    path: Path  # the file
    dialect: Dialect  # how it writes its table
    data: bytes | None = None  # its content, where it is not that of the file

    def open(self) -> BinaryIO:
        """Return the content to be read."""
        return self.path.open("rb") if self.data is None else io.BytesIO(self.data)

    def load(self, names: Sequence[str], rows: int | None = None, torn: Torn | None = None) -> dict[str, np.ndarray]:
        """Read columns."""
        places = [self._place(name) for name in names]
        return dict(zip(names, _load(self, places, rows, torn), strict=True))

    def _place(self, name: str) -> int:
        places = self._places.get(name, [])
        if len(places) > 1:
            refuse_twins([name, name], self.path)
        if not places:
            raise InputError(Fault(name, "is not there", did_you_mean(name, self.dialect.names), str(self.path)))
        return places[0]

    @cached_property
    def _places(self) -> dict[str, list[int]]:
        """Columns by name."""
        found: dict[str, list[int]] = {}
        for place, name in enumerate(self.dialect.names):
            found.setdefault(name, []).append(place)
        return found


def open_text(path: Path, data: bytes | None = None) -> TextTable:
    """Tell the dialect of a text file from its head.

    Returns:
        The table, to be loaded.
    """
    refuse_special(path)
    try:
        with path.open("rb") if data is None else io.BytesIO(data) as file:
            head = file.read(HEAD)
        return TextTable(path, sniff(head, len(head) < HEAD), data)
    except (OSError, ValueError) as error:
        why = str(error) or type(error).__name__
        if why == "has no rows" and re.search(rb"(?i)[,;\t ](true|false)\s*[,;\t\r\n]", head):
            what = "has no rows of numbers: cells are True and False"
            raise InputError(Fault("", what, "write 1 and 0", str(path))) from error
        if why == "has no rows":
            raise InputError(Fault("", why, "numbers below the line of column names", str(path))) from error
        raise InputError(Fault("", f"cannot be read as CSV: {why}", REMEDY, str(path))) from error


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Read every column of numbers of a text file, of any dialect.

    Args:
        path: names above columns of numbers; columns of words are left out, unless they have a name of the contract.

    Returns:
        The columns as float64, empty cells NaN.

    Raises:
        InputError: it cannot be read, or a cell is not a number; names column and row.
    """
    table = open_text(path)
    refuse_twins(list(table.dialect.names), path)
    pairs = zip(table.dialect.names, table.dialect.numeric, strict=True)
    return table.load([name for name, numeric in pairs if numeric or name in SIGNAL_UNITS])


def refuse_twins(names: list[str], path: Path) -> None:
    """Refuse a file with two columns of one name."""
    twins = sorted(name for name, count in Counter(names).items() if count > 1)
    if twins:
        raise InputError([Fault(name, "is the name of several columns", "rename one", str(path)) for name in twins])


def _blocks(table: TextTable, file: BinaryIO) -> Iterator[bytes]:
    """Yield the rows in pieces of whole lines."""
    dialect = table.dialect
    decode = None if dialect.encoding in _SINGLE else codecs.getincrementaldecoder(dialect.encoding)("replace").decode
    left, skip = b"", dialect.skip
    if dialect.encoding == "utf-8-sig":
        file.seek(len(codecs.BOM_UTF8))
    while block := file.read(BLOCK):
        text = block if decode is None else decode(block).encode("utf-8", "replace")
        text = left + (text.replace(b"\r", b"\n") if dialect.newline == "\r" else text)
        while skip and (end := text.find(b"\n")) >= 0:
            text, skip = text[end + 1 :], skip - 1
        cut = 0 if skip else text.rfind(b"\n") + 1
        left = text[cut:]
        if len(left) > LINE:
            raise ValueError(f"a line has more than {LINE} bytes")
        if cut:
            yield _tidy(text[:cut], dialect)
    if left and not skip:
        yield _tidy(left, dialect)


def _tidy(block: bytes, dialect: Dialect) -> bytes:
    """Take out comments, signs of positive numbers and repeated white space."""
    if any(mark.encode() in block for mark in COMMENTS):
        marks = tuple(mark.encode() for mark in COMMENTS)
        lines = block.split(b"\n")
        block = b"\n".join(line for line in lines if not line.lstrip().startswith(marks))
    if b"+" in block and not any(dialect.forms):
        block = block.replace(b"+", b"")
    elif b"+" in block:  # that of a time zone stays
        block = re.sub(rb"(?m)(^|%s)([ \t]*)\+" % re.escape(dialect.delimiter).encode(), rb"\1\2", block)
    if dialect.thousands:
        block = ungrouped(block.decode("utf-8", "replace"), dialect.thousands).encode()
    if dialect.delimiter == " ":
        block = re.sub(rb"[ \t]+", b" ", block)
        block = b"\n".join(line.strip(b" ") for line in block.replace(b" \r", b"\r").split(b"\n"))
    return block


def _load(table: TextTable, places: Sequence[int], rows: int | None, torn: Torn | None) -> list[np.ndarray]:
    import pyarrow as pa

    wanted = sorted(set(places))
    damage = Torn() if torn is None else torn
    try:
        capacity = _lines(table) if rows is None else rows
        told = f"{len(wanted)} columns of up to {capacity} rows"
        refuse_beyond(8.0 * capacity * len(wanted), table.path, told, "name fewer channels, cut the file")
        arrays = [np.zeros(capacity) for _ in wanted]
        done = 0
        with table.open() as file:
            columns = Columns(table.dialect, wanted, damage)
            for block in _blocks(table, file):
                found = columns.of(block, done)
                count = min(len(found[0]) if found else 0, capacity - done)
                for values, part in zip(arrays, found, strict=True):
                    values[done : done + count] = part[:count]
                done += count
                if torn is None and damage:
                    raise _located(table, places, ValueError("damaged rows"))
                damage.refuse_beyond(max(MOST * capacity, SOME))
                if done == capacity:
                    break
        pa.default_memory_pool().release_unused()
        done = damage.without_last(done)
        damage.refuse_beyond(MOST * done)
    except TooMuchError as error:
        fault = _located(table, places, error).faults[0]
        what = f"{fault.message}; {error}"
        raise InputError(Fault(fault.key, what, fault.remedy, fault.file)) from error
    except (OSError, ValueError, pa.ArrowException) as error:
        raise _located(table, places, error) from error
    except MemoryError as error:
        raise InputError(Fault("", "does not fit into memory", "name fewer channels", str(table.path))) from error
    if not done:
        raise InputError(Fault("", "has no rows", "numbers below the line of column names", str(table.path)))
    by_place = dict(zip(wanted, arrays, strict=True))
    return [by_place[place][:done] for place in places]


def _lines(table: TextTable) -> int:
    """Return a number of lines that the file does not exceed."""
    mark = table.dialect.newline.encode()
    count = 1
    with table.open() as file:
        while block := file.read(BLOCK):
            count += block.count(mark)
    return count


def _located(table: TextTable, places: Sequence[int], error: Exception) -> InputError:
    """Return the fault with column and row, found by reading once more, slowly."""
    dialect, file = table.dialect, str(table.path)
    width, row = len(dialect.names), 0
    try:
        with table.open() as opened:
            lines = (line for block in _blocks(table, opened) for line in block.decode("utf-8", "replace").split("\n"))
            for line in lines:
                if not line.strip():
                    continue
                row += 1
                cells = split(line.rstrip("\r"), dialect.delimiter)
                if len(cells) != width and (len(cells) < width or len(cells) > max(dialect.most, width)):
                    remedy = (
                        "each row has as many cells as there are columns; a file that was cut off ends within a row"
                    )
                    return InputError(Fault(f"row {row}", f"has {len(cells)} cells, not {width}", remedy, file))
                for place in places:
                    if dialect.forms and dialect.forms[place] and form_of(cells[place]):
                        continue
                    if cells[place] and not is_number(cells[place], dialect.decimal) and cells[place] not in MISSING:
                        where = f"{dialect.names[place]}, row {row}"
                        mark = "comma" if dialect.decimal == "," else "point"
                        remedy = f"write plain numbers with a decimal {mark}"
                        return InputError(Fault(where, f"is {cells[place]!r}", remedy, file))
    except (OSError, ValueError):
        pass
    return InputError(Fault("", f"cannot be read as CSV: {error}", REMEDY, file))
