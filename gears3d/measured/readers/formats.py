"""Which format a file is of, by its content and not by the ending of its name; other packages read further ones."""

from __future__ import annotations

import re
from pathlib import Path

from gears3d.errors import Fault, InputError
from gears3d.inputs import is_folder, refuse_special
from gears3d.measured.readers.plugged import open_plugged
from gears3d.measured.readers.source import Source

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
        from gears3d.measured.readers.parquet import open_parquet

        return open_parquet(path)
    if head.startswith(b"TDSm"):
        from gears3d.measured.readers.tdms import open_tdms

        return open_tdms(path)
    if head.startswith((b"MDF     ", b"UnFinMF ")):
        from gears3d.measured.readers.mdf import open_mdf

        return open_mdf(path)
    if any(head[at : at + 8] == HDF5 for at in (0, 512, 1024, 2048)):
        from gears3d.measured.readers.hdf5 import open_hdf5

        return open_hdf5(path, "MATLAB v7.3" if head.startswith(b"MATLAB") else "HDF5")
    if head.startswith(b"MATLAB 5.0 MAT-file") or (path.suffix.lower() == ".mat" and head[:1] in (b"\x00", b"\x01")):
        from gears3d.measured.readers.matlab import open_matlab

        return open_matlab(path)
    if re.match(rb" {4}-1[ \t]*\r?\n *[0-9]{1,6}[bB]?\s", head):
        from gears3d.measured.readers.uff import open_uff

        return open_uff(path)
    if head.startswith((b"RIFF", b"RIFX", b"RF64")) and head[8:12] == b"WAVE":
        from gears3d.measured.readers.wav import open_wav

        return open_wav(path)
    if (plugged := open_plugged(path, head)) is not None:
        return plugged
    if head.startswith(b"PK\x03\x04"):
        from gears3d.measured.readers.spreadsheet import open_spreadsheet

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
    from gears3d.measured.readers.text import open_csv

    return open_csv(path)
