"""Columns of pyarrow as arrays, without what pyarrow loads to make them itself (pandas, 40 MB)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pyarrow


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
