"""Which format a file is of, by its content and not by the ending of its name; other packages read further ones."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gears3d.errors import Fault, GearsError, InputError
from gears3d.inputs import is_folder, refuse_special
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
HDF5 = b"\x89HDF\r\n\x1a\n"
# First number of files of catman: 5012 or near it, as published readers of the format have it.
CATMAN = range(5009, 5020)
# Bytes by which a format is known.
HEAD = 4096
READABLE = "Parquet, CSV, XLSX, ODS, MATLAB, HDF5, TDMS, MDF, UFF 58 and WAV are read"
_OTHERS = {
    b"PK\x03\x04": ("is a ZIP archive", "unpack it"),
    b"\x1f\x8b": ("is compressed by gzip", "unpack it: gunzip FILE"),
    b"\xd0\xcf\x11\xe0": ("is an old spreadsheet", "export the sheet as CSV"),
    b"7z\xbc\xaf": ("is a 7z archive", "unpack it"),
    b"%PDF": ("is a PDF", "export the numbers as CSV"),
    b"|CF,": ("is a file of imc (.raw, .dat)", "export it as MDF 4, MATLAB or ASCII in imc STUDIO or FAMOS"),
    b"\x93NUMPY": ("is an array of NumPy", 'numpy.savetxt("a.csv", array, delimiter=",", header="time_s,...")'),
    b"ARROW1": ("is an Arrow (Feather) file", "write Parquet: pyarrow.parquet.write_table"),
    b"version https://git-lfs": ("is a pointer of Git LFS and not the file itself", "git lfs pull"),
    b"<!DOCTYPE": ("is a web page and not the file itself", "download the raw file"),
    b"<html": ("is a web page and not the file itself", "download the raw file"),
}


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
            return _open_by(reader, package, path)
    return None


def _open_by(reader: Reader, package: str, path: Path) -> Source:
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


def open_source(path: str | Path) -> Source:
    """Open a measured file of any known format.

    Args:
        path: a file, or the folder of a recording.

    Returns:
        The opened file; its samples are not read yet.

    Raises:
        InputError: it is not there, empty, damaged, or of no format that is read.
    """
    path = Path(path)
    folder = is_folder(path)
    file = path / "signals.parquet" if folder else path
    refuse_special(file)
    try:
        with file.open("rb") as opened:
            head = opened.read(HEAD)
    except FileNotFoundError as error:
        what = "has no signals.parquet" if folder else "is not there"
        raise InputError(Fault("", what, "name a measured file or a folder of a recording", str(path))) from error
    except (OSError, ValueError) as error:
        raise InputError(Fault("", f"cannot be read: {error}", "name a measured file", str(path))) from error
    if not head.strip() and len(head) < HEAD:
        raise InputError(Fault("", "is empty", "record it again", str(path)))
    return _open(file, head)


def _open(path: Path, head: bytes) -> Source:
    if head.startswith(b"PAR1"):
        from gears3d.measured.readers.tables import open_parquet

        return open_parquet(path)
    if head.startswith(b"TDSm"):
        from gears3d.measured.readers.loggers import open_tdms

        return open_tdms(path)
    if head.startswith((b"MDF     ", b"UnFinMF ")):
        from gears3d.measured.readers.loggers import open_mdf

        return open_mdf(path)
    if any(head[at : at + 8] == HDF5 for at in (0, 512, 1024, 2048)):
        from gears3d.measured.readers.hdf5 import open_hdf5

        return open_hdf5(path, "MATLAB v7.3" if head.startswith(b"MATLAB") else "HDF5")
    if head.startswith(b"MATLAB 5.0 MAT-file") or (path.suffix.lower() == ".mat" and head[:1] in (b"\x00", b"\x01")):
        from gears3d.measured.readers.matlab import open_matlab

        return open_matlab(path)
    if re.match(rb" {4}-1[ \t]*\r?\n *[0-9]{1,6}[bB]?\s", head):
        from gears3d.measured.readers.loggers import open_uff

        return open_uff(path)
    if head.startswith((b"RIFF", b"RIFX", b"RF64")) and head[8:12] == b"WAVE":
        from gears3d.measured.readers.loggers import open_wav

        return open_wav(path)
    if (plugged := open_plugged(path, head)) is not None:
        return plugged
    if head.startswith(b"PK\x03\x04"):
        from gears3d.measured.readers.tables import open_spreadsheet

        if (sheet := open_spreadsheet(path)) is not None:
            return sheet
    for mark, (what, remedy) in _OTHERS.items():
        if head.startswith(mark):
            raise InputError(Fault("", what, remedy, str(path)))
    if path.suffix.lower() == ".bin" and int.from_bytes(head[:2], "little") in CATMAN:
        what = f"is a file of catman (version {int.from_bytes(head[:2], 'little')})"
        raise InputError(Fault("", what, "export it as MATLAB, MDF 4 or ASCII in catman", str(path)))
    if re.match(rb"\x80[\x02-\x05]", head):
        raise InputError(Fault("", "is a pickle of Python, which could run code", "export CSV or Parquet", str(path)))
    if re.match(rb"\s*[{\[]\s*[\"{\[]", head) and path.suffix.lower() == ".json":
        raise InputError(Fault("", "is JSON", "write a table: CSV or Parquet", str(path)))
    if path.suffix.lower() in (".parquet", ".mat", ".tdms", ".mf4", ".mdf", ".h5", ".hdf5"):
        what = f"does not begin as a {path.suffix.lower()} file does"
        raise InputError(Fault("", what, f"it is damaged, or something else: {READABLE}", str(path)))
    from gears3d.measured.readers.tables import open_csv

    return open_csv(path)
