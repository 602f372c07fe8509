"""MATLAB v4 to v7.2, by scipy.io; v7.3 is HDF5."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.inputs import most_bytes, refuse_beyond
from gears3d.measured.readers.foreign import reading
from gears3d.measured.readers.hdf5 import COLUMNS
from gears3d.measured.readers.matlab_size import loaded_bytes
from gears3d.measured.readers.source import Signal, Source


def open_matlab(path: Path) -> Source:
    """Open a MATLAB file; a structure is a group, a matrix gives its columns ``M column 1``, ``M column 2``.

    Args:
        path: the file.

    Raises:
        InputError: it is damaged, or takes too much memory.
    """
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version

    with reading(path, "MATLAB"):
        if matfile_version(path)[0] == 0:
            size = 16.0 * sum(math.prod(shape) for _, shape, _ in whosmat(path))
        else:
            size = loaded_bytes(path, most_bytes())
    refuse_beyond(size, path, "its matrices", "save fewer of them in one file")
    with reading(path, "MATLAB"):
        held = loadmat(path, simplify_cells=True)
        found = dict(_arrays("", held))
    signals = tuple(Signal(name, "", len(values)) for name, values in found.items())

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        return {name: found[name][:most].astype(np.float64) for name in names}

    return Source(str(path), "MATLAB", signals, load, {}, tuple(_notes("", held)))


def _arrays(prefix: str, node: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield every vector of numbers and every column of a matrix, with the way to it."""
    if isinstance(node, dict):
        for key, value in node.items():
            if not key.startswith("__"):
                yield from _arrays(f"{prefix}/{key}" if prefix else key, value)
    elif isinstance(node, np.ndarray) and node.dtype.kind in "biuf" and node.size > 1:
        if node.ndim == 1:
            yield prefix, node
        elif node.ndim == 2 and min(node.shape) <= COLUMNS:
            table = node if node.shape[0] >= node.shape[1] else node.T
            for k in range(table.shape[1]):
                yield f"{prefix} column {k + 1}", table[:, k]


def _notes(prefix: str, node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        for key, value in node.items():
            if not key.startswith("__"):
                yield from _notes(f"{prefix}.{key}" if prefix else key, value)
    elif isinstance(node, str | int | float | np.number):
        yield f"{prefix} = {node}"
