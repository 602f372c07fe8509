"""Readers of other packages, found through the entry-point group ``gears3d.readers``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gears3d.errors import Fault, GearsError, InputError
from gears3d.measured.readers.source import Source
from gears3d.plugins import plug_in, warn

GROUP = "gears3d.readers"
# Names of formats that gears3d reads itself.
BUILT_IN = (
    "Parquet",
    "CSV",
    "text",
    "MATLAB",
    "MATLAB v7.3",
    "HDF5",
    "TDMS",
    "MDF",
    "UFF",
    "UFF 58",
    "XLSX",
    "ODS",
    "WAV",
)


@dataclass(frozen=True)
class Reader:
    """A format that another package reads.

    Args:
        name: of the format, for messages.
        recognises: takes a file and its first 4096 bytes, returns whether it is of the format.
        open: takes such a file, returns its signals; samples are read when they are asked for.

    >>> Reader("ABC", lambda path, head: head.startswith(b"ABC1"), lambda path: Source(str(path), "ABC", (), dict)).name
    'ABC'
    """

    name: str
    recognises: Callable[[Path, bytes], bool]
    open: Callable[[Path], Source]


@cache
def readers() -> dict[str, tuple[Reader, str]]:
    """Return the readers of other packages and the names of these, by name of the format."""
    found: dict[str, tuple[Reader, str]] = {}
    taken = {name.lower(): "gears3d" for name in BUILT_IN}

    def accept(load: Callable[[], Any], package: str) -> None:
        one = load()
        if not isinstance(one, Reader):
            raise TypeError(f"{one!r:.80} is not a gears3d.measured.readers.Reader")
        if one.name.lower() in taken:
            raise ValueError(f"the format {one.name!r} is read by {taken[one.name.lower()]} already")
        found[one.name], taken[one.name.lower()] = (one, package), package

    plug_in(GROUP, accept)
    return found


def open_plugged(path: Path, head: bytes) -> Source | None:
    """Open a file by the reader of another package.

    Returns ``None`` when no reader recognises it. Raises InputError, which names the package, when that
    reader fails.
    """
    for name, (reader, package) in list(readers().items()):
        try:
            fits = reader.recognises(path, head)
        except Exception as error:  # code of third parties may raise any exception
            warn(GROUP, name, package, f"{type(error).__name__}: {error}")
            del readers()[name]
            continue
        if fits:
            return _open(reader, package, path)
    return None


def _open(reader: Reader, package: str, path: Path) -> Source:
    try:
        source = reader.open(path)
        if not isinstance(source, Source):
            raise TypeError(f"returns {type(source).__name__}, not a Source")
    except GearsError:
        raise
    except Exception as error:
        what = f"cannot be read as {reader.name} by the package {package}: {type(error).__name__}: {error}"
        raise InputError(Fault("", what, f"damaged, or a fault of {package}", str(path))) from error
    return source
