"""Reading CSV records, with faults that name the line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Read a CSV record.

    Args:
        path: a file with a line of column names and numbers below it, separated by comma, semicolon or tab.

    Returns:
        The columns as float64, empty cells NaN.

    Raises:
        InputError: it cannot be read, or a cell is no number; names column and line.
    """
    import pyarrow as pa
    from pyarrow import csv

    try:
        with path.open(encoding="utf-8-sig") as file:
            header = file.readline()
        options = csv.ParseOptions(delimiter=_separator(header))
        reading = csv.ReadOptions(use_threads=False)
        table = csv.read_csv(path, read_options=reading, parse_options=options)
    except (OSError, ValueError, pa.ArrowException) as error:
        remedy = "a line of column names, then numbers, separated by commas"
        raise InputError(Fault("", f"cannot be read as CSV: {error}", remedy, str(path))) from error
    names = [name.strip() for name in table.column_names]
    refuse_twins(names, path)
    if not table.num_rows:
        raise InputError(Fault("", "has no rows", "numbers below the line of column names", str(path)))
    return {name: _numbers(name, column, path) for name, column in zip(names, table.columns, strict=True)}


def refuse_twins(names: list[str], path: Path) -> None:
    """Refuse a file with two columns of one name.

    Args:
        names: of its columns.
        path: named in the fault.

    Raises:
        InputError: a name occurs twice.
    """
    twins = sorted({name for name in names if names.count(name) > 1})
    if twins:
        raise InputError([Fault(name, "is the name of several columns", "rename one", str(path)) for name in twins])


def _separator(header: str) -> str:
    return next((mark for mark in (",", ";", "\t") if mark in header), ",")


def _numbers(name: str, column: Any, path: Path) -> np.ndarray:
    import pyarrow as pa

    kind = column.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind):
        return column.cast(pa.float64()).to_numpy()
    numbers = np.full(len(column), np.nan)
    for row, cell in enumerate(column.to_pylist()):
        try:
            numbers[row] = float(cell) if cell not in (None, "") else np.nan
        except (TypeError, ValueError):
            where = f"{name}, row {row + 1}"
            remedy = "write plain numbers with a decimal point"
            raise InputError(Fault(where, f"is {str(cell)!r}", remedy, str(path))) from None
    return numbers
