"""MATLAB v4 to v7.2, by scipy.io; v7.3 is HDF5. Tables, timetables and other objects by mat-io."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.inputs import most_bytes, refuse_beyond
from gears3d.measured.readers.foreign import library, reading
from gears3d.measured.readers.matlab_size import loaded_bytes
from gears3d.measured.readers.source import Signal, Source, Whole, seconds, unique
from gears3d.measured.readers.structures import COLUMNS, Stated, as_number, children, joined, stated

# How MATLAB writes a table without objects.
PLAIN = (
    "or save it in MATLAB as plain numbers: T = timetable2table(TT); T.Time = seconds(T.Time - T.Time(1)); "
    "S = table2struct(T,'ToScalar',true); save('x.mat','-struct','S','-v7')"
)


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
