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
    import pyarrow.csv

    try:
        with path.open(encoding="utf-8-sig") as file:
            header = file.readline()
        options = pa.csv.ParseOptions(delimiter=_separator(header))
        reading = pa.csv.ReadOptions(use_threads=False)
        table = pa.csv.read_csv(path, read_options=reading, parse_options=options)
    except (OSError, ValueError, pa.ArrowException) as error:
        remedy = "a line of column names, then numbers, separated by commas"
        raise InputError(Fault("", f"cannot be read as CSV: {error}", remedy, str(path))) from error
    return {name.strip(): _numbers(name.strip(), table[name], path) for name in table.column_names}


def _separator(header: str) -> str:
    return next((mark for mark in (",", ";", "\t") if mark in header), ",")


def _numbers(name: str, column: Any, path: Path) -> np.ndarray:
    import pyarrow as pa

    kind = column.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind):
        return column.cast(pa.float64()).to_numpy()
    for row, cell in enumerate(column.to_pylist()):
        try:
            float(cell if cell is not None else "nan")
        except (TypeError, ValueError):
            where = f"signals.{name}, line {row + 2}"
            raise InputError(Fault(where, f"is {str(cell)!r}", "write plain numbers, 0.5", str(path))) from None
    return np.array([float(cell) if cell else np.nan for cell in column.to_pylist()])
