"""RIGLOG, a made-up format: a line that names it, a line of JSON with the channels, and float64 rows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers import Reader, Signal, Source

MAGIC = b"RIGLOG 1\n"


def write(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write a record: columns by name, the unit in brackets."""
    rows = np.column_stack(list(columns.values())).astype("<f8")
    Path(path).write_bytes(MAGIC + json.dumps(list(columns)).encode() + b"\n" + rows.tobytes())


def open_riglog(path: Path) -> Source:
    """Open a record; its samples are read when they are asked for."""
    with path.open("rb") as file:
        file.readline()
        names, start = json.loads(file.readline()), file.tell()
    rows, rest = divmod(path.stat().st_size - start, 8 * len(names))
    if rest:
        raise InputError(Fault("", "ends amid a row", "export it again", str(path)))

    def load(wanted, most):
        values = np.memmap(path, "<f8", "r", start, (rows, len(names)))[:most]
        return {name: np.array(values[:, names.index(name)]) for name in wanted}

    return Source(str(path), "RIGLOG", tuple(Signal(name, rows=rows) for name in names), load)


READER = Reader("RIGLOG", lambda path, head: head.startswith(MAGIC), open_riglog)
