"""How a file is written: under a temporary name beside its place, renamed when it is whole."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from gears3d.errors import Fault, InputError, UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURES = (".png", ".svg", ".pdf")
"""Endings of pictures."""


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Give a temporary path to write to; it takes the place of ``path`` when the block ends well.

    A block that fails leaves nothing behind, and what was there before stays as it was.

    Args:
        path: where the file is to be; folders on the way are made.

    Yields:
        The temporary path.

    Raises:
        InputError: the file cannot be written.

    >>> with replacing("/dev/null/at/all.txt") as unfinished:
    ...     _ = unfinished.write_text("lost")
    Traceback (most recent call last):
    gears3d.errors.InputError: /dev/null/at/all.txt: cannot be written: Not a directory (name another place)
    """
    place = Path(path)
    unfinished = place.with_name(f".{place.name}.{os.getpid()}.tmp")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        yield unfinished
        unfinished.replace(place)
    except OSError as error:
        why = error.strerror or str(error)
        raise InputError(Fault("", f"cannot be written: {why}", "name another place", str(place))) from error
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


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
    gears3d.errors.UsageError: map.bmp: a picture ends in .png, .svg, .pdf
    """
    ending = Path(path).suffix.lower()
    if ending not in PICTURES:
        raise UsageError(f"{path}: a picture ends in {', '.join(PICTURES)}")
    with replacing(path) as unfinished:
        draw().savefig(unfinished, format=ending[1:], dpi=130)
    return Path(path)
