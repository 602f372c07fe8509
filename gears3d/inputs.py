"""Checks before a file is read: regular file, length of text, memory required."""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from gears3d.errors import Fault, InputError, UsageError

# Environment variable: limit of the memory for one file or run, in bytes.
VARIABLE = "GEARS3D_MAX_BYTES"
# Bytes of a scenario or another file that people write.
MOST_TEXT = 1 << 18
_KINDS = {
    stat.S_ISFIFO: "a pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
    stat.S_ISSOCK: "a socket",
}
_CGROUP = Path("/sys/fs/cgroup/memory.max")


def most_bytes() -> int:
    """Return the limit of the memory for one file or run: half of the machine's memory, or the variable's value.

    Raises:
        UsageError: the variable holds no positive number.
    """
    told = os.environ.get(VARIABLE, "").strip()
    if told:
        try:
            most = int(float(told))
        except (ValueError, OverflowError):
            most = 0
        if most <= 0:
            raise UsageError(f"{VARIABLE} is {told!r}: give a positive number of bytes, e.g. {VARIABLE}=8e9")
        return most
    try:
        room = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError, AttributeError):
        room = 1 << 34
    with suppress(OSError, ValueError):
        room = min(room, int(_CGROUP.read_text(encoding="ascii")))
    return room // 2


def refuse_beyond(size: float, file: str | Path, what: str, remedy: str, key: str = "") -> None:
    """Refuse data that require more memory than permitted, before they are loaded.

    Args:
        size: bytes, declared or estimated.
        file: that contains the data.
        what: the data, subject of the message.
        remedy: for the message.
        key: in the file.

    Raises:
        InputError: it is more than :func:`most_bytes`.

    >>> refuse_beyond(1e30, "a.h5", "its channels", "name fewer")
    Traceback (most recent call last):
    gears3d.errors.InputError: a.h5: its channels require 9.31e+20 GiB of memory, ...
    """
    most = most_bytes()
    if size > most:
        told = f"{what} require {size / 2**30:.3g} GiB of memory, {most / 2**30:.3g} GiB are permitted"
        raise InputError(Fault(key, told, f"{remedy}, or set {VARIABLE}", str(file)))


def refuse_special(path: str | Path) -> None:
    """Refuse pipes, devices, sockets and invalid file names; other errors appear when the file is opened.

    Args:
        path: named by people.

    Raises:
        InputError: it is one of these.

    >>> refuse_special("/dev/zero")
    Traceback (most recent call last):
    gears3d.errors.InputError: /dev/zero: is a device, not a file (name a file)
    """
    try:
        mode = Path(path).stat().st_mode
    except OSError:
        return
    except ValueError as error:
        what = "is not a valid file name: it contains a NUL character"
        raise InputError(Fault("", what, "name a file", str(path))) from error
    for test, kind in _KINDS.items():
        if test(mode):
            raise InputError(Fault("", f"is {kind}, not a file", "name a file", str(path)))


def is_file(path: str | Path) -> bool:
    r"""Return whether there is a file of this name; false for names that no file can have.

    Args:
        path: named by people.

    >>> is_file("a" * 1000), is_file("a\0b")
    (False, False)
    """
    return stat.S_ISREG(_mode(path))


def is_folder(path: str | Path) -> bool:
    """Return whether there is a folder of this name.

    Args:
        path: named by people.
    """
    return stat.S_ISDIR(_mode(path))


def is_there(path: str | Path) -> bool:
    """Return whether there is anything of this name.

    Args:
        path: named by people.
    """
    return bool(_mode(path))


def _mode(path: str | Path) -> int:
    try:
        return Path(path).stat().st_mode
    except (OSError, ValueError):
        return 0


def stdin_bytes(most: int) -> bytes:
    """Return what standard input holds.

    Args:
        most: bytes that it may have.

    Raises:
        InputError: it has more, or nothing.
    """
    data = sys.stdin.buffer.read(most + 1)
    if not data:
        raise InputError(Fault("", "standard input is empty", "pipe a file into the command", "-"))
    if len(data) > most:
        raise InputError(Fault("", f"has more than {most} bytes", "name a file instead", "-"))
    return data


def spooled() -> Path:
    """Return a temporary file with what standard input holds; it is removed when the process ends.

    Raises:
        InputError: standard input is empty, or larger than permitted.
    """
    folder = Path(tempfile.mkdtemp(prefix="gears3d-stdin-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    file = folder / "stdin"
    file.write_bytes(stdin_bytes(most_bytes()))
    return file


def read_text(path: Path, most: int = MOST_TEXT) -> str:
    """Return the text of a file that people write.

    Args:
        path: the file, UTF-8.
        most: bytes that it may have.

    Raises:
        InputError: it is not a regular file, or too long.
        OSError: it cannot be read.
        UnicodeDecodeError: it is not UTF-8.
    """
    refuse_special(path)
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        size = path.stat().st_size
        raise InputError(Fault("", f"has {size} bytes, at most {most} are read", "is it the right file?", str(path)))
    return data.decode("utf-8")
