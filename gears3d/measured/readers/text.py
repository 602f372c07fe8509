"""CSV and its dialects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gears3d.measured.readers.source import Signal, Source, unique


def open_csv(path: Path) -> Source:
    """Open a text file with columns of numbers, of whatever dialect.

    Args:
        path: the file.

    Raises:
        InputError: it is no text, or has no rows of numbers.
    """
    from gears3d.recording.text import open_text

    table = open_text(path)
    dialect = table.dialect
    names = unique(dialect.names)
    table = type(table)(path, dialect._replace(names=tuple(names)))
    units = dialect.units or ("",) * len(names)
    known = zip(names, units, dialect.numeric, strict=True)
    signals = tuple(Signal(name, unit, numeric=numeric) for name, unit, numeric in known)

    def load(wanted: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        return table.load(wanted, most)

    return Source(str(path), "CSV", signals, load, {}, tuple(line for line in dialect.header if line.strip()))
