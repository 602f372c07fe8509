"""Reading tables in text files, a block at a time, with faults that name column and row."""

from __future__ import annotations

import codecs
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.inputs import refuse_beyond, refuse_special
from gears3d.recording.columns import SIGNAL_UNITS
from gears3d.recording.dialect import COMMENTS, HEAD, MISSING, Dialect, is_number, sniff, split, ungrouped
from gears3d.recording.rows import Columns, TooMuchError, Torn
from gears3d.recording.stamps import form_of

BLOCK = 1 << 18
"""Bytes read at a time."""
LINE = 1 << 20
"""Bytes of a line."""
MOST = 0.01
"""Share of damaged rows beyond which a file is refused: so many are no accident, the dialect is another one."""
SOME = 1000
"""Damaged rows that are read in any case before the share is known."""
REMEDY = "a line of column names, then numbers, separated by commas"
_SINGLE = ("utf-8", "utf-8-sig", "cp1252", "latin-1")


@dataclass(frozen=True)
class TextTable:
    """A table in a text file, of which nothing but the head is read yet.

    Args:
        path: the file.
        dialect: how it writes its table.
        data: its content, where it is not that of the file.
    """

    path: Path
    dialect: Dialect
    data: bytes | None = None

    def open(self) -> BinaryIO:
        """Return the content to be read."""
        return self.path.open("rb") if self.data is None else io.BytesIO(self.data)

    def load(self, names: Sequence[str], rows: int | None = None, torn: Torn | None = None) -> dict[str, np.ndarray]:
        """Read columns.

        Args:
            names: which; each the name of one column.
            rows: the first so many; all when ``None``.
            torn: takes up which rows were damaged, up to 1 % of them; without it the first damaged row is an error.

        Returns:
            Float64 arrays, (n,), NaN where a cell is empty; dates and epochs count from the first one.

        Raises:
            InputError: a name is not there or not unique, a cell is no number, or rows differ in length.
        """
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

    Args:
        path: a file with rows of numbers.
        data: its content as text, where the file is of another format.

    Returns:
        The table, to be loaded.

    Raises:
        InputError: it cannot be read, is no text, or has no rows of numbers.
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
        InputError: it cannot be read, or a cell is no number; names column and row.
    """
    table = open_text(path)
    refuse_twins(list(table.dialect.names), path)
    pairs = zip(table.dialect.names, table.dialect.numeric, strict=True)
    return table.load([name for name, numeric in pairs if numeric or name in SIGNAL_UNITS])


def refuse_twins(names: list[str], path: Path) -> None:
    """Refuse a file with two columns of one name.

    Args:
        names: of its columns.
        path: named in the fault.

    Raises:
        InputError: a name occurs twice.
    """
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
                    remedy = "each row has as many cells as there are columns; a file that was cut off ends amid a row"
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
