"""Columns of pyarrow as arrays and back, without what pyarrow loads to do it itself (pandas, 40 MB)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pyarrow


def column_of(values: np.ndarray) -> pyarrow.Array:
    """Return an array of numbers as a column; nothing is copied, and NaN stays NaN.

    Args:
        values: (n,).

    >>> column_of(np.arange(6.0)[::2]).to_pylist(), str(column_of(np.zeros(2, np.int8)).type)
    ([0.0, 2.0, 4.0], 'int8')
    """
    import pyarrow as pa

    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def named_of(codes: np.ndarray, names: Sequence[str]) -> pyarrow.Array:
    """Return codes as a column of names.

    Args:
        codes: places among the names, (n,).
        names: ASCII.

    >>> named_of(np.array([1, 0, 1], np.int8), ("active", "reverse")).to_pylist()
    ['reverse', 'active', 'reverse']
    """
    import pyarrow as pa

    begin = np.cumsum([0, *map(len, names)], dtype=np.int32)
    told = pa.StringArray.from_buffers(len(names), pa.py_buffer(begin), pa.py_buffer("".join(names).encode()))
    return pa.DictionaryArray.from_arrays(column_of(codes), told)


def floats_of(column: pyarrow.Array) -> np.ndarray:
    """Return a column of float64 as an array, missing values NaN; where none is missing nothing is copied.

    Args:
        column: of type float64.

    >>> import pyarrow as pa
    >>> floats_of(pa.array([1.0, None, 3.0])).tolist(), floats_of(pa.array([1.0, 2.0, None, 4.0])[1:]).tolist()
    ([1.0, nan, 3.0], [2.0, nan, 4.0])
    """
    count, begin = len(column), column.offset
    known, numbers = column.buffers()
    if numbers is None or not count:
        return np.zeros(count)
    values = np.frombuffer(numbers, np.float64, count, 8 * begin)
    if not column.null_count or known is None:
        return values
    bits = np.unpackbits(np.frombuffer(known, np.uint8), bitorder="little", count=begin + count)
    return np.where(bits[begin:] == 1, values, np.nan)
