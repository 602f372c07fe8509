"""Writing files atomically: in a hidden temporary folder next to the destination, then moved into place."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

from gears3d.errors import Fault, InputError, UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Endings of pictures.
PICTURES = (".png", ".svg", ".pdf")
# Prefixes of temporary folders: next to a destination, and in the system's temporary directory.
HIDDEN, PRIVATE = ".gears3d-", "gears3d-"
_LOCK, _BEFORE, _NEW = "lock", "before", "new"
# Attempts to lock a new folder before another process removes it; one is the rule.
_ATTEMPTS = 100
_looked: set[Path] = set()


@contextmanager
def temporary(parent: str | Path, prefix: str = HIDDEN) -> Iterator[Path]:
    """Create an empty temporary folder for this process and remove it afterwards.

    The folder of a killed process is removed by the next process that creates one in the same parent. It is recognised
    by its lock, which the operating system releases with the process; process ids are no proof, they repeat in
    containers.

    Args:
        parent: the folder in which it is created.
        prefix: of its name.

    Yields:
        Its path.

    Raises:
        OSError: it cannot be created.
    """
    parent = Path(parent).absolute()
    if parent not in _looked:
        _looked.add(parent)
        _clear(parent, prefix)
    folder, held = _begin(parent, prefix)
    try:
        (folder / _NEW).mkdir()  # a destination may have any name, that of the lock as well
        yield folder / _NEW
    finally:
        _remove(folder, held)


def _remove(folder: Path, held: IO[str]) -> None:
    """Restore what was moved out and not replaced, and remove a folder, its lock last.

    The folder of an interrupted removal still has its lock, by which the next process recognises it.
    """
    for before in (folder / _BEFORE).glob("*"):
        if not (folder.parent / before.name).exists():
            before.rename(folder.parent / before.name)
    for part in (_NEW, _BEFORE):
        shutil.rmtree(folder / part, ignore_errors=True)
    held.close()  # Windows cannot delete an open file
    with suppress(OSError):
        (folder / _LOCK).unlink()
        folder.rmdir()


def _begin(parent: Path, prefix: str) -> tuple[Path, IO[str]]:
    """Create a folder with a locked file in it; repeat if another process removed it before it was locked."""
    for _ in range(_ATTEMPTS):
        folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        try:
            held = (folder / _LOCK).open("w")
        except FileNotFoundError:
            continue
        except OSError:
            folder.rmdir()
            raise
        try:
            lock(held)
        except (BlockingIOError, PermissionError):
            held.close()
            continue
        except OSError:  # a file system without locks: no process removes the folder of another
            pass
        if (folder / _LOCK).exists():
            return folder, held
        held.close()
    raise OSError(f"no temporary folder can be locked in {parent}")


def _clear(parent: Path, prefix: str) -> None:
    """Remove the folders of dead processes; restore a destination that was moved out but not replaced."""
    with suppress(OSError):
        for entry in [entry for entry in os.scandir(parent) if entry.name.startswith(prefix)]:
            with suppress(OSError):
                if not entry.is_dir(follow_symlinks=False) or not _own(entry):
                    continue
                folder = Path(entry)
                if not (folder / _LOCK).exists():
                    folder.rmdir()  # raises unless it is empty; a process that has just created it creates another
                    continue
                with (folder / _LOCK).open("r+") as held:
                    lock(held)
                    _remove(folder, held)


def _own(folder: os.DirEntry[str]) -> bool:
    """Return whether a folder belongs to this user: others may write to the same parent."""
    return not hasattr(os, "getuid") or folder.stat(follow_symlinks=False).st_uid == os.getuid()


_outside: dict[str, str] = {}


def own_temporaries() -> None:
    """Redirect temporary files of this process, its libraries and child processes into one folder.

    The folder is removed when the process ends, or at the next start if it is killed. Call this before importing
    libraries with exit handlers such as ``multiprocessing``: handlers run in reverse order of registration. Nothing
    changes if the system has no writable temporary directory.
    """
    try:
        inner = temporary(tempfile.gettempdir(), PRIVATE)
        folder = inner.__enter__()
    except OSError:
        return
    atexit.register(inner.__exit__, None, None, None)
    _outside["TMPDIR"] = os.environ.get("TMPDIR", "")
    tempfile.tempdir = os.environ["TMPDIR"] = str(folder)


def outside_environment() -> dict[str, str]:
    """Return the environment for a program that outlives this process: with the system's temporary directory."""
    return {name: value for name, value in {**os.environ, **_outside}.items() if value or name not in _outside}


def lock(file: IO[str]) -> None:
    """Lock a file until it is closed or the process ends.

    Args:
        file: open for writing.

    Raises:
        OSError: another process has locked it.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    else:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def exchange(new: Path, place: Path, folder: Path) -> None:
    """Move a file or folder to its destination; an existing one is moved to a temporary folder first.

    Args:
        new: the file or folder to move.
        place: the destination.
        folder: from :func:`temporary`, in the same parent as the destination.

    Raises:
        OSError: a move failed; the existing file or folder is restored with the end of :func:`temporary`.
    """
    before = folder.parent / _BEFORE / place.name
    before.parent.mkdir(exist_ok=True)
    if place.exists():
        place.rename(before)
    new.rename(place)


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Give a temporary path to write to; it takes the place of ``path`` when the block ends well.

    A block that fails leaves nothing behind, and what was there before stays as it was.

    Args:
        path: where the file is to be; folders on the way are made. If it is a link, its target is replaced. A
            device or pipe receives the content at the end.

    Yields:
        The temporary path, of the same name.

    Raises:
        InputError: the file cannot be written.

    >>> with replacing("/dev/null/at/all.txt") as unfinished:
    ...     _ = unfinished.write_text("lost")
    Traceback (most recent call last):
    gears3d.errors.InputError: /dev/null/at/all.txt: cannot be written: Not a directory (name another place)
    """
    refuse_name(path)
    special = Path(path).exists() and not Path(path).is_file() and not Path(path).is_dir()
    place = Path(path) if special else Path(path).resolve()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with temporary(tempfile.gettempdir() if special else place.parent) as folder:
            unfinished = folder / place.name
            yield unfinished
            if special:
                with unfinished.open("rb") as whole, place.open("wb") as sink:
                    shutil.copyfileobj(whole, sink)
            else:
                unfinished.replace(place)
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)  # libraries put pages into ``strerror``
        raise InputError(Fault("", f"cannot be written: {why}", "name another place", str(path))) from error


def refuse_name(path: str | Path) -> None:
    """Refuse an invalid file name.

    Args:
        path: of a file or folder.

    Raises:
        InputError: it contains a NUL character, is too long, or is a circular link.
    """
    try:
        Path(path).resolve().exists()
    except (ValueError, OSError, RuntimeError) as error:
        why = f"is not a valid file name: {getattr(error, 'strerror', None) or error}"
        raise InputError(Fault("", why, "name another place", str(path).replace("\0", "\\0"))) from None


def refuse_file(path: str | Path, endings: tuple[str, ...] = ()) -> None:
    """Refuse a destination where no file can be written, before the work that would be lost.

    Args:
        path: of the file, existing or not.
        endings: permitted ones; any if empty.

    Raises:
        UsageError: the ending is not permitted.
        InputError: the name is invalid, it is a folder, or its folder cannot be written.

    >>> refuse_file("map.bmp", (".png", ".svg"))
    Traceback (most recent call last):
    gears3d.errors.UsageError: map.bmp: the name of this file ends in .png, .svg
    """
    if endings and Path(path).suffix.lower() not in endings:
        raise UsageError(f"{path}: the name of this file ends in {', '.join(endings)}")
    refuse_name(path)
    if Path(path).is_dir():
        raise InputError(Fault("", "cannot be written: Is a directory", "name a file in it", str(path)))
    if not Path(path).exists():
        _refuse_parent(Path(path))


def _refuse_parent(path: Path) -> None:
    """Refuse a destination whose nearest existing folder cannot be written."""
    folder = path.resolve().parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir() or not os.access(folder, os.W_OK | os.X_OK):
        why = "Permission denied" if folder.is_dir() else "Not a directory"
        raise InputError(Fault("", f"cannot be written: {why}: {folder}", "name another place", str(path)))


def refuse_folder(place: Path) -> None:
    """Refuse a destination where no folder can be created.

    Args:
        place: of a folder, existing or not.

    Raises:
        InputError: the name is invalid, or it is a file or a dangling link.
    """
    remedy = "name another folder with --out"
    refuse_name(place)
    if place.is_symlink() and not place.exists():
        raise InputError(Fault("--out", f"{place} is a link to {place.readlink()}, which does not exist", remedy))
    if place.exists() and not place.is_dir():
        raise InputError(Fault("--out", f"{place} is a file", remedy))
    if not place.exists():
        try:
            _refuse_parent(place)
        except InputError as error:
            raise InputError(Fault("--out", f"{place} {error.faults[0].message}", remedy)) from None


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file, whole or not at all.

    Args:
        path: where it is to be.
        text: its content.

    Returns:
        The path.

    Raises:
        InputError: it cannot be written.
    """
    return write_bytes(path, text.encode())


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Write a binary file, whole or not at all.

    Args:
        path: where it is to be.
        data: its content.

    Returns:
        The path.

    Raises:
        InputError: it cannot be written.
    """
    with replacing(path) as unfinished:
        unfinished.write_bytes(data)
    return Path(path)


def write_picture(path: str | Path, draw: Callable[[], Figure]) -> Path:
    """Write a picture, whole or not at all.

    Args:
        path: ends in ``.png``, ``.svg`` or ``.pdf``.
        draw: gives the figure; not asked when the ending is another.

    Returns:
        The path.

    Raises:
        UsageError: the ending is another.
        InputError: it cannot be written.

    >>> write_picture("map.bmp", lambda: 1 / 0)
    Traceback (most recent call last):
    gears3d.errors.UsageError: map.bmp: the name of this file ends in .png, .svg, .pdf
    """
    refuse_file(path, PICTURES)
    with replacing(path) as unfinished:
        draw().savefig(unfinished, format=Path(path).suffix.lower()[1:], dpi=130)
    return Path(path)
