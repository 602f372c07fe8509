"""Blocks of lines as columns of numbers: by pyarrow, or a line at a time where a block has damaged rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gears3d.recording.arrow import floats_of
from gears3d.recording.dialect import MISSING, Dialect, is_number, split
from gears3d.recording.stamps import NEVER, Exact, Stamps

SHOWN = 5
"""Rows that a message names."""


class TooMuchError(Exception):
    """A file has more damaged rows than may be left out."""


@dataclass
class Torn:
    """Which rows of a table were damaged; rows count from 1 below the names.

    Args:
        gaps: indices of rows that hold NaN because their cells are too few or too many.
        rows: such rows, those that were left out at the beginning and at the end among them.
        words: rows without any number, left out: repeated names, messages of a logger.
        cells: column and row of single cells that are no number, NaN.
    """

    gaps: list[int] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    words: list[int] = field(default_factory=list)
    cells: list[tuple[str, int]] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.rows or self.words or self.cells)

    def refuse_beyond(self, most: float) -> None:
        """Refuse more damage than may be left out; a row that was cut at either end counts for nothing.

        Raises:
            TooMuchError: there is more.
        """
        count = len(self.gaps) + len(self.words) + len(self.cells)
        if count > most:
            raise TooMuchError(f"{count} rows are damaged, at most 1 % may be left out")

    def without_last(self, count: int) -> int:
        """Leave out a damaged last row and return the number of rows.

        Args:
            count: of rows so far.
        """
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
    """Turns the blocks of a table into columns, one block after the other.

    Args:
        dialect: of the table.
        places: of the columns, rising.
        torn: takes up what is damaged.
    """

    def __init__(self, dialect: Dialect, places: Sequence[int], torn: Torn) -> None:
        self._dialect, self._places, self._torn = dialect, places, torn
        forms = dialect.forms or ("",) * len(dialect.names)
        self._exact = {place: int(forms[place].split()[1]) for place in places if forms[place].startswith("exact")}
        counters = {place: Exact(digits) for place, digits in self._exact.items()}
        stamps = {place: Stamps(forms[place]) for place in places if forms[place] and place not in counters}
        self._counters, self._stamps = counters, stamps

    def of(self, block: bytes, done: int) -> list[np.ndarray]:
        """Return the columns of a block, each (n,).

        Args:
            block: whole lines.
            done: rows before it that were kept.
        """
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
            elif not rows and not done:  # a logger that was joined amid a row
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
