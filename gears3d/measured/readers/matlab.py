"""MATLAB v4 to v7.2, by scipy.io; v7.3 is HDF5. Tables, timetables and other objects by mat-io."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.inputs import most_bytes, refuse_beyond
from gears3d.measured.readers.source import Signal, Source, Whole, library, reading, seconds, unique
from gears3d.measured.readers.structures import COLUMNS, Stated, as_number, children, joined, stated

HEADER = 128
BLOCK = 1 << 16
MATRIX, COMPRESSED = 14, 15
# Bytes of a stored number, by type of the element.
_STORED = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
# Bytes of a loaded number, by class of the matrix: characters are UCS-4, other classes have numbers of 8 bytes.
_LOADED = {4: 4, 6: 8, 7: 4, 8: 1, 9: 1, 10: 2, 11: 2, 12: 4, 13: 4, 14: 8, 15: 8}
# Type and size of the first element of a matrix, which has its class.
FLAGS = (6, 8)
CLASSES = 17
# Classes that have names of fields, behind their size, name and this element: the length of a name.
STRUCTURES = (2, 3)
LENGTH = (5, 4)
# Bytes of a matrix besides its numbers, as an object of Python.
OBJECT = 200
# How MATLAB writes a table without objects.
PLAIN = (
    "or save it in MATLAB as plain numbers: T = timetable2table(TT); T.Time = seconds(T.Time - T.Time(1)); "
    "S = table2struct(T,'ToScalar',true); save('x.mat','-struct','S','-v7')"
)


def loaded_bytes(path: Path, most: float) -> float:
    """Return the size in memory of the matrices of a file; counting ends beyond ``most`` [bytes].

    Compressed matrices are unpacked in pieces that are discarded: the declared sizes may be wrong.

    Raises zlib.error or ValueError when the file is damaged.
    """
    total = 0.0
    with path.open("rb") as file:
        order = "<" if file.read(HEADER)[126:128] == b"IM" else ">"
        while total <= most and len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            end = file.tell() + size
            if kind != COMPRESSED:
                file.seek(-8, 1)
            content = _Unpacked(file, size) if kind == COMPRESSED else _Plain(file, end)
            for one in _elements(content, order):
                total += one
                if total > most:
                    break
            file.seek(end)
    return total


class _Plain:
    """The elements of a variable as they lie in the file."""

    def __init__(self, file: BinaryIO, end: int) -> None:
        self.file, self.end = file, end

    def read(self, count: int) -> bytes:
        """Return the next bytes, fewer at the end."""
        return self.file.read(count) if self.file.tell() < self.end else b""

    def skip(self, count: int) -> None:
        """Leave out bytes."""
        self.file.seek(count, 1)


class _Unpacked:
    """The elements of a compressed variable; no more than a block is held."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self.file, self.left = file, size
        self.zip = zlib.decompressobj()
        self.held = b""

    def read(self, count: int) -> bytes:
        """Return the next bytes, fewer at the end."""
        while len(self.held) < count and not self.zip.eof:
            packed = self.zip.unconsumed_tail
            if not packed:
                packed = self.file.read(min(BLOCK, self.left))
                self.left -= len(packed)
                if not packed:
                    break
            self.held += self.zip.decompress(packed, BLOCK)
        given, self.held = self.held[:count], self.held[count:]
        return given

    def skip(self, count: int) -> None:
        """Leave out bytes."""
        while count > 0 and (some := self.read(min(count, BLOCK))):
            count -= len(some)


def _elements(content: _Plain | _Unpacked, order: str) -> Iterator[float]:
    """Iterate over the sizes of the elements of one variable, nested matrices included [bytes]."""
    loaded, begins = 8, False
    own, have = 0, 3
    while len(tag := content.read(8)) == 8:
        kind, size = struct.unpack(f"{order}II", tag)
        inside = kind >> 16
        if inside:  # up to four bytes stand in the tag itself
            kind, size = kind & 0xFFFF, inside
        if kind == MATRIX and not inside:
            _refuse_incomplete(own, have)
            begins = size > 0
            own, have = 0, 3
            yield OBJECT
            continue
        if kind not in _STORED or (begins and (inside or (kind, size) != FLAGS)):
            raise ValueError(f"an element of type {kind} and {size} bytes")  # scipy ends the process on some
        have += 1
        if own in STRUCTURES and have == 3 and (kind, size) != LENGTH:
            raise ValueError(f"a structure whose names have an element of type {kind} and {size} bytes")
        yield size / _STORED[kind] * max(loaded, _STORED[kind])
        if begins:
            flags = content.read(size)
            own = struct.unpack(f"{order}I", flags[:4])[0] & 0xFF if len(flags) == size else 0
            if not 1 <= own <= CLASSES:
                raise ValueError(f"a matrix of class {own}")
            loaded, begins, size, have = _LOADED.get(own, 8), False, 0, 0
        content.skip(0 if inside else size + -size % 8)
    _refuse_incomplete(own, have)


def _refuse_incomplete(own: int, have: int) -> None:
    """Refuse a matrix of characters or numbers that ends before they begin: scipy reads on behind it."""
    if own in _LOADED and have < 3:
        raise ValueError(f"a matrix of class {own} with {have} elements")


def open_matlab(path: Path) -> Source:
    """Open a MATLAB file; a structure is a group, a matrix gives its columns ``M column 1``, ``M column 2``.

    Raises InputError when it is damaged, or takes too much memory.
    """
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version

    with reading(path, "MATLAB"):
        version = matfile_version(path)[0]
        if version == 0:
            size = 16.0 * sum(math.prod(shape) for _, shape, _ in whosmat(path))
        else:
            size = loaded_bytes(path, most_bytes())
    refuse_beyond(size, path, "its matrices", "save fewer of them in one file")
    with reading(path, "MATLAB"):
        held = loadmat(path, simplify_cells=True)
    if version and "__function_workspace__" in held:
        return open_objects(path)
    return _source(path, "MATLAB", held, {})


def open_objects(path: Path) -> Source:
    """Open a MATLAB file of any version that holds tables, timetables or other objects.

    Raises InputError when it is damaged, or holds no numbers. Raises MissingExtraError when mat-io is not installed.
    """
    matio = library("matio", path, PLAIN)
    with reading(path, "MATLAB"):
        held = matio.load_from_mat(str(path), add_table_attrs=True)
        units: dict[str, str] = {}
        tree = {str(name): _plain(str(name), value, units) for name, value in held.items()}
    source = _source(path, "MATLAB objects", tree, units)
    if not source.signals:
        raise InputError(Fault("", "holds objects without numbers", PLAIN.removeprefix("or "), str(path)))
    return source


def _source(path: Path, form: str, held: dict[str, Any], units: dict[str, str]) -> Source:
    found: list[tuple[Signal, np.ndarray]] = []
    with reading(path, "MATLAB"):
        told = stated(held)
        for own, values in _arrays("", held, 0):
            found += _signals(own, values, told.get(own, Stated()), units.get(own, ""))
    names = unique([signal.name for signal, _ in found])
    arrays = {name: values for name, (_, values) in zip(names, found, strict=True)}
    first = {signal.name: name for name, (signal, _) in reversed(list(zip(names, found, strict=True)))}
    signals = tuple(
        Signal(name, each.unit, each.rows, each.clock, first.get(each.axis, ""))
        for name, (each, _) in zip(names, found, strict=True)
    )

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        whole = Whole()
        return {name: whole.floats(name, arrays[name][:most]) for name in names}

    with reading(path, "MATLAB"):
        notes = tuple(_notes("", held, 0))
    return Source(str(path), form, signals, load, {}, notes)


def _signals(path: str, values: np.ndarray, told: Stated, unit: str) -> list[tuple[Signal, np.ndarray]]:
    """Return the signals of an array: itself, or the columns of a matrix."""
    table = values.reshape(-1, 1) if values.ndim == 1 else values if values.shape[0] >= values.shape[1] else values.T
    count = table.shape[1]
    names = told.names if len(told.names) == count else ()
    plain = [path] if count == 1 and values.ndim == 1 else [f"{path} column {k + 1}" for k in range(count)]
    return [
        (Signal(name, told.unit(k) or unit, len(table), told.clock, told.axis), table[:, k])
        for k, name in enumerate(names or plain)
    ]


def _arrays(prefix: str, node: Any, depth: int) -> Iterator[tuple[str, np.ndarray]]:
    """Iterate over every vector and matrix of numbers with its path."""
    if isinstance(node, np.ndarray) and node.dtype.kind in "biuf":
        if node.size > 1 and (node.ndim == 1 or (node.ndim == 2 and min(node.shape) <= COLUMNS)):
            yield prefix, node
    elif depth < 32:
        for key, value in children(node):
            yield from _arrays(joined(prefix, key), value, depth + 1)


def _plain(name: str, value: Any, units: dict[str, str]) -> Any:
    """Return what mat-io gives as dictionaries and arrays; tables become dictionaries of their columns."""
    if hasattr(value, "columns") and hasattr(value, "index"):
        about = getattr(value, "attrs", {})
        listed = about.get("varUnits") or about.get("VariableUnits") or []
        table: dict[str, Any] = {}
        for at, key in enumerate(value.columns):
            table[str(key)] = _column(value[key])
            unit = listed[at] if at < len(listed) else ""
            if table[str(key)] is not None and getattr(unit, "strip", None):
                units[f"{name}/{key}"] = str(unit).strip()
        rows = _column(value.index) if value.index.dtype.kind in "mM" else None
        if rows is not None:
            own = str(value.index.name or "Time")
            table = {own: rows} | table
            units[f"{name}/{own}"] = "s"
        for key, dtype in zip(map(str, value.columns), value.dtypes, strict=True):
            if dtype.kind in "mM":
                units[f"{name}/{key}"] = "s"
        return {key: column for key, column in table.items() if column is not None}
    if isinstance(value, dict):
        return {str(key): _plain(f"{name}/{key}", one, units) for key, one in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.names:
        rows = [{key: _plain("", one[key], {}) for key in value.dtype.names} for one in value.ravel()]
        return rows[0] if len(rows) == 1 else rows
    if isinstance(value, np.ndarray) and value.dtype.kind in "mM":
        return _dated(value)
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return np.squeeze(value) if value.ndim <= 2 else value
    return getattr(value, "properties", value)


def _column(series: Any) -> np.ndarray | None:
    values = np.asarray(series)
    if values.dtype.kind in "mM":
        return _dated(values)
    return values if values.dtype.kind in "biuf" else None


def _dated(values: np.ndarray) -> np.ndarray:
    """Return dates as seconds since the first one, and durations as seconds."""
    if values.dtype.kind == "M":
        return seconds(values.ravel())
    whole = values.ravel().astype("timedelta64[ns]")
    return np.where(np.isnat(whole), np.nan, whole.astype(np.int64) / 1e9)


def _notes(prefix: str, node: Any, depth: int) -> Iterator[str]:
    if isinstance(node, str) or (not isinstance(node, dict | list | np.ndarray) and as_number(node) is not None):
        yield f"{prefix} = {node}"
    elif depth < 32:
        items = node.items() if isinstance(node, dict) else children(node)
        for key, value in items:
            if not str(key).startswith("__"):
                yield from _notes(f"{prefix}.{key}" if prefix else str(key), value, depth + 1)
