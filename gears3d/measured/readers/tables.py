"""Tables: CSV and its dialects, spreadsheets (.xlsx and .ods, read as a stream within bounds), and Parquet.

Both kinds of spreadsheet are XML in a ZIP archive. The parser of the standard library reads them a block at a time; no
sheet is held as a tree, and what an archive declares to unpack to is compared with the limit before anything is
unpacked.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.inputs import most_bytes, refuse_beyond
from gears3d.measured.readers.source import Remark, Signal, Source, Whole, reading, refuse_large, seconds, unique
from gears3d.measured.readers.structures import clock_of
from gears3d.measured.readers.unit import stated_clock
from gears3d.recording.columns import floats_of

# Bytes of XML that are parsed at a time.
BLOCK = 1 << 16
# Rows that show whether a sheet is a table.
TRIED = 1000
# Bytes of memory for a byte of unpacked XML.
GROWTH = 4
# Columns of a sheet that are read.
WIDEST = 1024
# Characters of a table for a byte of its XML, and those that any may have: more are empty or repeated cells.
SPARSE, SPARE = 16.0, 1e6
# Formats of .xlsx that are dates or times: ECMA-376, part 1, 18.8.30.
_DATES = frozenset([*range(14, 23), *range(45, 48)])
_DATED = re.compile(r"[ymdhs]", re.IGNORECASE)
_QUOTED = re.compile(r'"[^"]*"|\[[^\]]*\]|\\.')
_DAY_ZERO = datetime(1899, 12, 30)
# Rows of a batch.
ROWS = 1 << 16
# Bytes read from the file at a time.
BUFFER = 1 << 16


def open_csv(path: Path) -> Source:
    """Open a text file with columns of numbers, of any dialect.

    Raises InputError when it is not text, or has no rows of numbers.
    """
    return source_of(path, "CSV")


def source_of(path: Path, form: str, data: bytes | None = None) -> Source:
    """Return a table of text as a source.

    Raises InputError when it is not text, or has no rows of numbers.
    """
    from gears3d.recording.text import Torn, open_text

    table = open_text(path, data)
    dialect = table.dialect
    names = unique(dialect.names)
    table = type(table)(path, dialect._replace(names=tuple(names)), data)
    units = dialect.units or ("",) * len(names)
    known = zip(names, units, dialect.numeric, strict=True)
    notes = tuple(line for line in dialect.header if line.strip())
    clock = stated_clock(notes)
    signals = tuple(Signal(name, unit, clock=clock, numeric=numeric) for name, unit, numeric in known)

    gaps: list[int] = []
    remarks: list[Remark] = []

    def load(wanted: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        torn = Torn()
        found = table.load(wanted, most, torn)
        gaps[:] = torn.gaps
        remarks[:] = [Remark(*each) for each in torn.told()]
        return found

    return Source(str(path), form, signals, load, {}, notes, gaps, remarks)


class _Table:
    """Rows of text that grow within a bound."""

    def __init__(self, path: Path, name: str, xml: int) -> None:
        self.path, self.name = path, name
        self.lines: list[str] = []
        self.size, self.most = 0, min(most_bytes() / GROWTH, SPARE + SPARSE * xml)

    def add(self, cells: dict[int, str]) -> None:
        """Add a row of cells by column; empty ones at the end are left out, and so are empty rows."""
        given = {place: text for place, text in cells.items() if text and place < WIDEST}
        if not given:
            return
        width = min(max(given) + 1, WIDEST)
        self.size += width + sum(map(len, given.values()))
        if self.size > self.most:
            what = f"sheet {self.name!r} consists of empty or repeated cells"
            raise InputError(Fault("", what, "export the sheet as CSV", str(self.path)))
        self.lines.append("\t".join(given.get(place, "") for place in range(width)))


def open_spreadsheet(path: Path) -> Source | None:
    """Open a spreadsheet; every sheet with rows of numbers is a group where there are several.

    Returns ``None`` where the archive is not a spreadsheet. Raises InputError when it is damaged, too large, or has no
    rows of numbers.
    """
    with reading(path, "a spreadsheet"), zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        if not names & {"xl/workbook.xml", "content.xml"}:
            return None
        size = sum(each.file_size for each in archive.infolist() if each.filename.endswith(".xml"))
        refuse_beyond(GROWTH * size, path, "its sheets", "export the sheet as CSV")
        tables = _xlsx(path, archive) if "xl/workbook.xml" in names else _ods(path, archive)
    found = []
    for table in tables:
        widest = max((line.count("\t") for line in table.lines), default=0)
        text = "\n".join(line + "\t" * (widest - line.count("\t")) for line in table.lines)
        try:
            source = source_of(path, "spreadsheet", text.encode())
            source.load([each.name for each in source.signals if each.numeric], TRIED)
        except InputError:  # a sheet of words, or about the device
            continue
        found.append((table.name, source))
    if not found:
        raise InputError(Fault("", "has no rows of numbers in any sheet", "numbers below a row of names", str(path)))
    return found[0][1] if len(found) == 1 else _grouped(path, found)


def _grouped(path: Path, found: Sequence[tuple[str, Source]]) -> Source:
    """Return several sheets as one source, each as a group."""
    signals, places = [], {}
    for name, source in found:
        for each in source.signals:
            own = f"{name.replace('/', '_')}/{each.name}"
            places[own] = source, each.name
            signals.append(Signal(own, each.unit, each.rows, each.clock, numeric=each.numeric))
    notes = tuple(note for _, source in found for note in source.notes)
    whole = Source(str(path), "spreadsheet", tuple(signals), lambda names, most: load(names, most), {}, notes)

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        values: dict[str, np.ndarray] = {}
        whole.remarks.clear()
        for _, source in found:
            own = [name for name in names if places[name][0] is source]
            if own:
                loaded = source.load([places[name][1] for name in own], most)
                values |= {name: np.delete(loaded[places[name][1]], source.gaps) for name in own}
                whole.remarks.extend(source.remarks)
        return {name: values[name] for name in names}

    return whole


def _parsed(
    archive: zipfile.ZipFile,
    name: str,
    start: Callable[[str, dict[str, str]], None],
    end: Callable[[str], None],
    text: Callable[[str], None],
) -> None:
    """Parse a member of an archive; documents with entities of their own are refused."""
    parser = expat.ParserCreate(namespace_separator=None)
    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text

    def refuse(*_: Any) -> None:
        raise ValueError("its XML has a document type")

    parser.StartDoctypeDeclHandler = refuse
    with archive.open(name) as file:
        while block := file.read(BLOCK):
            parser.Parse(block, False)
        parser.Parse(b"", True)


def _plain(text: str) -> str:
    return " ".join(text.replace('"', "'").split())


def _column(reference: str) -> int:
    """Return the column of a reference such as ``AB12``, from 0.

    >>> _column("A1"), _column("AB12")
    (0, 27)
    """
    place = 0
    for sign in reference:
        if not "A" <= sign <= "Z" or place > WIDEST:
            break
        place = place * 26 + ord(sign) - 64
    return place - 1


def _xlsx(path: Path, archive: zipfile.ZipFile) -> list[_Table]:
    """Return the sheets of a workbook."""
    names = archive.namelist()
    targets: dict[str, str] = {}
    sheets: list[tuple[str, str]] = []

    def related(tag: str, about: dict[str, str]) -> None:
        if tag == "Relationship":
            target = about.get("Target", "").lstrip("/")
            targets[about.get("Id", "")] = target if target.startswith("xl/") else f"xl/{target}"

    def listed(tag: str, about: dict[str, str]) -> None:
        if tag.rpartition(":")[2] == "sheet":
            sheets.append((about.get("name", ""), about.get("r:id", "")))

    def nothing(*_: Any) -> None:
        return

    if "xl/_rels/workbook.xml.rels" in names:
        _parsed(archive, "xl/_rels/workbook.xml.rels", related, nothing, nothing)
    _parsed(archive, "xl/workbook.xml", listed, nothing, nothing)
    strings = _strings(archive) if "xl/sharedStrings.xml" in names else []
    dated = _dated(archive) if "xl/styles.xml" in names else []
    return [
        _sheet(path, archive, name, targets[key], strings, dated)
        for name, key in sheets
        if targets.get(key) in names and "worksheets/" in targets[key]
    ]


def _strings(archive: zipfile.ZipFile) -> list[str]:
    found: list[str] = []
    parts: list[str] = []
    inside = [False]

    def start(tag: str, about: dict[str, str]) -> None:
        inside[0] = tag == "t"
        if tag == "si":
            parts.clear()

    def end(tag: str) -> None:
        inside[0] = False
        if tag == "si":
            found.append(_plain("".join(parts)))

    def text(data: str) -> None:
        if inside[0]:
            parts.append(data)

    _parsed(archive, "xl/sharedStrings.xml", start, end, text)
    return found


def _dated(archive: zipfile.ZipFile) -> list[bool]:
    """Return which styles of cells show dates or times."""
    own: dict[int, bool] = {}
    styles: list[bool] = []
    inside = [False]

    def start(tag: str, about: dict[str, str]) -> None:
        if tag == "numFmt":
            code = _QUOTED.sub("", about.get("formatCode", ""))
            own[int(about.get("numFmtId", "0"))] = _DATED.search(code) is not None and "General" not in code
        elif tag == "cellXfs":
            inside[0] = True
        elif tag == "xf" and inside[0]:
            number = int(about.get("numFmtId", "0"))
            styles.append(own.get(number, number in _DATES))

    def end(tag: str) -> None:
        if tag == "cellXfs":
            inside[0] = False

    _parsed(archive, "xl/styles.xml", start, end, lambda data: None)
    return styles


def _sheet(
    path: Path, archive: zipfile.ZipFile, name: str, member: str, strings: list[str], dated: list[bool]
) -> _Table:
    table = _Table(path, name, archive.getinfo(member).file_size)
    cells: dict[int, str] = {}
    parts: list[str] = []
    about_cell: dict[str, str] = {}
    place, inside = [-1], [False]

    def start(tag: str, about: dict[str, str]) -> None:
        if tag == "row":
            cells.clear()
            place[0] = -1
        elif tag == "c":
            about_cell.clear()
            about_cell.update(about)
            parts.clear()
            place[0] = _column(about["r"]) if "r" in about else place[0] + 1
        inside[0] = tag in ("v", "t")

    def end(tag: str) -> None:
        inside[0] = False
        if tag == "c" and 0 <= place[0] < WIDEST:
            cells[place[0]] = _cell("".join(parts), about_cell, strings, dated)
        elif tag == "row":
            table.add(cells)

    def text(data: str) -> None:
        if inside[0]:
            parts.append(data)

    _parsed(archive, member, start, end, text)
    return table


def _cell(text: str, about: dict[str, str], strings: list[str], dated: list[bool]) -> str:
    """Return a cell of .xlsx as text; dates in the form of ISO 8601."""
    kind = about.get("t", "n")
    if kind == "s":
        at = int(text or "0")
        return strings[at] if 0 <= at < len(strings) else ""
    if kind != "n":
        return "" if kind == "e" else _plain(text)
    style = int(about.get("s", "0"))
    if text and style < len(dated) and dated[style]:
        days = float(text)
        if 1.0 <= days < 2_958_466.0:  # 9999-12-31
            return (_DAY_ZERO + timedelta(days=days)).isoformat(" ", timespec="microseconds")
        if 0.0 <= days < 1.0:
            return (_DAY_ZERO + timedelta(days=days)).time().isoformat(timespec="microseconds")
    return text.strip()


def _ods(path: Path, archive: zipfile.ZipFile) -> list[_Table]:
    """Return the sheets of an OpenDocument spreadsheet."""
    tables: list[_Table] = []
    size = archive.getinfo("content.xml").file_size
    cells: dict[int, str] = {}
    parts: list[str] = []
    held: dict[str, Any] = {"place": 0, "cell": None, "rows": 1, "depth": 0}

    def start(tag: str, about: dict[str, str]) -> None:
        if tag == "table:table":
            tables.append(_Table(path, about.get("table:name", ""), size))
        elif tag == "table:table-row":
            cells.clear()
            held.update(place=0, rows=int(about.get("table:number-rows-repeated", "1")))
        elif tag in ("table:table-cell", "table:covered-table-cell"):
            parts.clear()
            held["cell"] = about
        elif tag == "text:p" and held["cell"] is not None:
            held["depth"] += 1

    def end(tag: str) -> None:
        if tag in ("table:table-cell", "table:covered-table-cell"):
            about = held["cell"] or {}
            written = about.get("office:value") or about.get("office:date-value") or _clock(about)
            text = written or _plain("".join(parts))
            repeats = int(about.get("table:number-columns-repeated", "1"))
            first = held["place"]
            for place in range(first, min(first + repeats, WIDEST) if text else first):
                cells[place] = text
            held.update(place=min(first + repeats, WIDEST), cell=None)
        elif tag == "text:p":
            held["depth"] = max(held["depth"] - 1, 0)
        elif tag == "table:table-row" and tables and any(cells.values()):
            for _ in range(max(held["rows"], 1)):
                tables[-1].add(cells)

    def text(data: str) -> None:
        if held["depth"]:
            parts.append(data)

    _parsed(archive, "content.xml", start, end, text)
    return tables


def _clock(about: dict[str, str]) -> str:
    """Return a time of OpenDocument, ``PT10H00M00.5S``, as a clock time."""
    match = re.fullmatch(r"PT(\d+)H(\d+)M(\d+)(?:[.,](\d+))?S", about.get("office:time-value", ""))
    return "" if match is None else f"{match[1]}:{match[2]:0>2}:{match[3]:0>2}.{match[4] or 0}"


def open_parquet(path: Path) -> Source:
    """Open a Parquet file.

    Raises InputError when it is damaged, or two columns have one name.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    from gears3d.recording.columns import from_json
    from gears3d.recording.files import KEY
    from gears3d.recording.text import refuse_twins

    with reading(path, "Parquet"), pq.ParquetFile(path) as file:
        schema, about = file.schema_arrow, file.metadata
        rows = about.num_rows
        packed = max((about.row_group(k).total_byte_size for k in range(about.num_row_groups)), default=0)
        packed /= max(len(schema), 1)
        told = {key.decode("utf-8", "replace"): value for key, value in (schema.metadata or {}).items() if key != KEY}
        clock = clock_of(told)
        meta = from_json((schema.metadata or {}).get(KEY, b"{}"))
    refuse_twins(list(schema.names), path)
    signals = [_signal(column, rows, clock) for column in schema]

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        count = rows if most is None else min(rows, most)
        words = [each.name for each in signals if each.name in names and not each.numeric]
        if words:
            remedy = "write numbers, or name other channels in record.toml"
            raise InputError([Fault(name, "holds no numbers", remedy, str(path)) for name in words])
        refuse_large(path, [count] * len(names), packed * len(names))
        arrays = {name: np.zeros(count) for name in names}
        with reading(path, "Parquet"), pq.ParquetFile(path, buffer_size=BUFFER) as file:
            stamps: dict[str, Any] = {}
            whole = Whole()
            done = 0
            for batch in _batches(file, names):
                size = min(batch.num_rows, count - done)
                for name, values in arrays.items():
                    values[done : done + size] = _floats(batch.column(name), stamps, name, whole)[:size]
                done += size
                if done == count:
                    break
        pa.default_memory_pool().release_unused()
        return arrays

    return Source(str(path), "Parquet", tuple(signals), load, meta)


def _batches(file: Any, names: Sequence[str]) -> Iterator[Any]:
    """Iterate over batches of rows by row group: pyarrow keeps what it has read until an iterator ends."""
    for group in range(file.metadata.num_row_groups):
        yield from file.iter_batches(ROWS, row_groups=[group], columns=list(names), use_threads=False)


def _signal(column: Any, rows: int, clock: tuple[float, float] | None) -> Signal:
    import pyarrow as pa

    kind = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
    dated = pa.types.is_timestamp(kind)
    tests = (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal, pa.types.is_boolean, pa.types.is_null)
    told = column.metadata or {}
    unit = (told.get(b"unit") or told.get(b"units") or b"").decode("utf-8", "replace")
    unit = "s" if dated else "" if unit == "1" else unit
    return Signal(column.name, unit, rows, clock, numeric=dated or any(test(kind) for test in tests))


def _floats(column: Any, stamps: dict[str, Any], name: str, whole: Whole) -> np.ndarray:
    """Return a column as numbers; dates count from the first batch's first, long whole numbers from their origin."""
    import pyarrow as pa

    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    if pa.types.is_timestamp(column.type):
        times = column.cast(pa.timestamp("ns")).to_numpy(zero_copy_only=False)
        first = stamps.setdefault(name, times[:1])
        return seconds(np.concatenate([first, times]))[1:]
    if column.type in (pa.int64(), pa.uint64()):
        known = column.is_valid().to_numpy(zero_copy_only=False)
        values = np.full(len(column), np.nan)
        values[known] = whole.floats(name, column.drop_null().to_numpy(zero_copy_only=False))
        return values
    if column.type != pa.float64():  # casting loads pyarrow.compute, which takes longer than most records
        column = column.cast(pa.float64(), safe=False)
    return floats_of(column)
