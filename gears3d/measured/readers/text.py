"""CSV and its dialects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gears3d.measured.readers.source import Remark, Signal, Source, unique
from gears3d.measured.readers.stated import stated_clock


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
