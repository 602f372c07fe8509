"""Parquet, by pyarrow, a batch of rows at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.foreign import reading
from gears3d.measured.readers.source import Signal, Source, Whole, refuse_large, seconds
from gears3d.measured.readers.structures import clock_of
from gears3d.recording.columns import floats_of

# Rows of a batch.
ROWS = 1 << 16
# Bytes read from the file at a time.
BUFFER = 1 << 16


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
