"""Recordings in files: Parquet with units and metadata, and CSV."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError, UsageError
from gears3d.files import replacing
from gears3d.inputs import is_file, is_folder, is_there, refuse_beyond, refuse_special
from gears3d.recording.columns import (
    FLANKS,
    Table,
    column_of,
    from_json,
    impact_table,
    named_of,
    part_of,
    signal_table,
    to_json,
    unit_of,
)
from gears3d.recording.text import read_csv, refuse_twins

if TYPE_CHECKING:
    import pyarrow


KEY = b"gears3d"  # Key of the metadata in the Parquet schema
ROWS = 1 << 18  # Rows of a group
SIGNALS, IMPACTS = "signals.parquet", "impacts.parquet"


def write(path: Path, signals: Mapping[str, np.ndarray], impacts: Table, meta: dict[str, Any]) -> Path:
    """Write a recording into a folder, or one without impacts into a ``.parquet`` or ``.csv`` file; return the path."""
    if path.suffix in (".parquet", ".csv"):
        if len(impacts["time_s"]):
            raise UsageError(f"{path}: one file cannot hold the impacts: name a folder")
        put = write_csv if path.suffix == ".csv" else write_parquet
        with replacing(path) as unfinished:
            put(signals, meta, unfinished)
        return path
    for name, table in ((SIGNALS, signals), (IMPACTS, impacts)):
        with replacing(path / name) as unfinished:
            write_parquet(table, meta, unfinished)
    return path


def write_parquet(table: Mapping[str, np.ndarray], meta: dict[str, Any], path: Path) -> None:
    """Write one table, so many rows at a time; floats keep every bit, each field carries its unit."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    def arrays(rows: slice) -> list[Any]:
        parts = {name: part_of(table, name, rows) for name in table}
        return [named_of(part, FLANKS) if name == "flank" else column_of(part) for name, part in parts.items()]

    none = dict(zip(table, arrays(slice(0, 0)), strict=True))
    fields = [pa.field(name, own.type, nullable=False, metadata={"unit": unit_of(name)}) for name, own in none.items()]
    schema = pa.schema(fields, metadata={KEY: to_json(meta)})
    floats = [name for name, own in none.items() if pa.types.is_floating(own.type)]
    count = len(part_of(table, "time_s", slice(None))) if table else 0
    with pq.ParquetWriter(
        path,
        schema,
        compression="zstd",
        use_dictionary=["flank"] if "flank" in table else False,  # type: ignore[arg-type]
        use_byte_stream_split=floats,  # type: ignore[arg-type]
    ) as file:
        for first in range(0, max(count, 1), ROWS):
            file.write_table(pa.Table.from_arrays(arrays(slice(first, first + ROWS)), schema=schema))


def write_csv(table: Mapping[str, np.ndarray], meta: dict[str, Any], path: Path) -> None:
    """Write one table as CSV; the metadata stays behind."""
    import pyarrow as pa
    from pyarrow import csv

    with path.open("wb") as sink:
        csv.write_csv(pa.table(dict(table)), sink)


def tables_of(path: Path) -> tuple[Table, Table, dict[str, Any]]:
    """Read signals, impacts and metadata of a recording: a folder with both tables, or a Parquet or CSV file."""
    if is_folder(path):
        if not is_file(path / SIGNALS):
            remedy = "a folder of a recording has signals.parquet and impacts.parquet"
            raise InputError(Fault("", "has no signals.parquet", remedy, str(path)))
        path = path / SIGNALS
    refuse_special(path)
    if not is_there(path):
        raise InputError(Fault("", "is not there", "name a run folder, a .parquet or a .csv file", str(path)))
    if path.suffix.lower() in (".csv", ".txt"):
        return signal_table(read_csv(path), str(path)), {}, {}
    signals, meta = read_parquet(path)
    impacts: dict[str, Any] = {}
    beside = path.with_name(IMPACTS)
    if path.name == SIGNALS and beside.is_file():
        impacts = impact_table(read_parquet(beside)[0], str(beside))
    return signal_table(signals, str(path)), impacts, meta or _of_summary(path.parent)


def read_parquet(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read one table."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        about = pq.read_metadata(path)
        size = sum(about.row_group(k).total_byte_size for k in range(about.num_row_groups))
        size = max(size, 8 * about.num_rows * about.num_columns)
        refuse_beyond(size, path, f"{about.num_columns} columns of {about.num_rows} rows", "cut the file")
        words = [column.name for column in about.schema.to_arrow_schema() if _is_text(column.type)]
        table = pq.read_table(path, read_dictionary=words)
        told = (table.schema.metadata or {}).get(KEY) or (about.metadata or {}).get(KEY, b"{}")
        meta = from_json(told)
    except (OSError, ValueError, pa.ArrowException) as error:
        why = f": {error}" if path.suffix == ".parquet" else ""
        remedy = "name a run folder, a .parquet or a .csv file"
        raise InputError(Fault("", f"cannot be read as Parquet{why}", remedy, str(path))) from error
    refuse_twins(table.column_names, path)
    return {name: _values(table[name]) for name in table.column_names}, meta


def _is_text(kind: pyarrow.DataType) -> bool:
    import pyarrow as pa

    return pa.types.is_string(kind) or pa.types.is_binary(kind)


def _values(column: pyarrow.ChunkedArray) -> np.ndarray:
    import pyarrow as pa

    if not pa.types.is_dictionary(column.type):
        return column.to_numpy()
    parts = [np.zeros(0, dtype=object)]
    for chunk in column.chunks:  # each text once, however many rows have it
        words = np.fromiter([*chunk.dictionary.to_pylist(), None], dtype=object)
        places = chunk.indices.fill_null(len(words) - 1) if chunk.indices.null_count else chunk.indices
        parts.append(words[places.to_numpy(zero_copy_only=False)])
    found = np.concatenate(parts)
    return found if _is_text(column.type.value_type) else np.array(found.tolist())


def _of_summary(folder: Path) -> dict[str, Any]:
    """Return metadata from ``summary.json`` for tables that have none of their own."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return {key: summary[key] for key in ("title", "source", "model", "version", "period_s") if key in summary}
    except (OSError, ValueError, TypeError):
        return {}


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """Read the columns of a file that need not be a recording.

    Args:
        path: a Parquet or CSV file.

    Returns:
        The columns as arrays, missing values NaN.

    Raises:
        InputError: it is not there or cannot be read.
    """
    refuse_special(path)
    if not is_file(path):
        raise InputError(
            Fault("", "is not a regular file" if is_there(path) else "is not there", "name a file", str(path))
        )
    return read_csv(path) if path.suffix.lower() in (".csv", ".txt") else read_parquet(path)[0]
