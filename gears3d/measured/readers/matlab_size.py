"""How much memory a MATLAB file of version 5 to 7.2 takes once it is loaded, without loading it."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

HEADER = 128
BLOCK = 1 << 16
MATRIX, COMPRESSED = 14, 15
# Bytes of a stored number, by type of the element.
_STORED = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
# Bytes of a loaded number, by class of the matrix: characters are UCS-4, other classes have numbers of 8 bytes.
_LOADED = {4: 4, 6: 8, 7: 4, 8: 1, 9: 1, 10: 2, 11: 2, 12: 4, 13: 4, 14: 8, 15: 8}
# Type and size of the first element of a matrix, which has its class.
FLAGS = (6, 8)
CLASSES = 17
# Classes that have names of fields, behind their size, name and this element: the length of a name.
STRUCTURES = (2, 3)
LENGTH = (5, 4)
# Bytes of a matrix besides its numbers, as an object of Python.
OBJECT = 200


def loaded_bytes(path: Path, most: float) -> float:
    """Return the size in memory of the matrices of a file; counting ends beyond ``most`` [bytes].

    Compressed matrices are unpacked in pieces that are discarded: the declared sizes may be wrong.

    Raises zlib.error or ValueError when the file is damaged.
    """
    total = 0.0
    with path.open("rb") as file:
        order = "<" if file.read(HEADER)[126:128] == b"IM" else ">"
        while total <= most and len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            end = file.tell() + size
            if kind != COMPRESSED:
                file.seek(-8, 1)
            content = _Unpacked(file, size) if kind == COMPRESSED else _Plain(file, end)
            for one in _elements(content, order):
                total += one
                if total > most:
                    break
            file.seek(end)
    return total


class _Plain:
    """The elements of a variable as they lie in the file."""

    def __init__(self, file: BinaryIO, end: int) -> None:
        self.file, self.end = file, end

    def read(self, count: int) -> bytes:
        """Return the next bytes, fewer at the end."""
        return self.file.read(count) if self.file.tell() < self.end else b""

    def skip(self, count: int) -> None:
        """Leave out bytes."""
        self.file.seek(count, 1)


class _Unpacked:
    """The elements of a compressed variable; no more than a block is held."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self.file, self.left = file, size
        self.zip = zlib.decompressobj()
        self.held = b""

    def read(self, count: int) -> bytes:
        """Return the next bytes, fewer at the end."""
        while len(self.held) < count and not self.zip.eof:
            packed = self.zip.unconsumed_tail
            if not packed:
                packed = self.file.read(min(BLOCK, self.left))
                self.left -= len(packed)
                if not packed:
                    break
            self.held += self.zip.decompress(packed, BLOCK)
        given, self.held = self.held[:count], self.held[count:]
        return given

    def skip(self, count: int) -> None:
        """Leave out bytes."""
        while count > 0 and (some := self.read(min(count, BLOCK))):
            count -= len(some)


def _elements(content: _Plain | _Unpacked, order: str) -> Iterator[float]:
    """Iterate over the sizes of the elements of one variable, nested matrices included [bytes]."""
    loaded, begins = 8, False
    own, have = 0, 3
    while len(tag := content.read(8)) == 8:
        kind, size = struct.unpack(f"{order}II", tag)
        inside = kind >> 16
        if inside:  # up to four bytes stand in the tag itself
            kind, size = kind & 0xFFFF, inside
        if kind == MATRIX and not inside:
            _refuse_incomplete(own, have)
            begins = size > 0
            own, have = 0, 3
            yield OBJECT
            continue
        if kind not in _STORED or (begins and (inside or (kind, size) != FLAGS)):
            raise ValueError(f"an element of type {kind} and {size} bytes")  # scipy ends the process on some
        have += 1
        if own in STRUCTURES and have == 3 and (kind, size) != LENGTH:
            raise ValueError(f"a structure whose names have an element of type {kind} and {size} bytes")
        yield size / _STORED[kind] * max(loaded, _STORED[kind])
        if begins:
            flags = content.read(size)
            own = struct.unpack(f"{order}I", flags[:4])[0] & 0xFF if len(flags) == size else 0
            if not 1 <= own <= CLASSES:
                raise ValueError(f"a matrix of class {own}")
            loaded, begins, size, have = _LOADED.get(own, 8), False, 0, 0
        content.skip(0 if inside else size + -size % 8)
    _refuse_incomplete(own, have)


def _refuse_incomplete(own: int, have: int) -> None:
    """Refuse a matrix of characters or numbers that ends before they begin: scipy reads on behind it."""
    if own in _LOADED and have < 3:
        raise ValueError(f"a matrix of class {own} with {have} elements")
