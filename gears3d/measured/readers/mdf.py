"""ASAM MDF, versions 3 and 4, by asammdf."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.foreign import library, reading
from gears3d.measured.readers.source import Signal, Source, Whole, refuse_large, unique

# Copies of the largest block in memory while asammdf decodes it.
COPIES = 6
# Characters of a formula, and conversions that refer to one another.
LONGEST, DEEPEST = 200, 8
_ARITHMETIC = re.compile(
    r"(?:\s|[-+*/()](?!\*)|X1?(?:\s?\*\*\s?[0-9](?![0-9.eE*]))?|(?:[0-9]{1,20}\.?[0-9]{0,20}|\.[0-9]{1,20})"
    r"(?:[eE][-+]?[0-9]{1,3})?|(?:sin|cos|tan|sqrt|exp|log|log10|abs)(?=\s*\())*"
)


def open_mdf(path: Path) -> Source:
    """Open an MDF file; each group has its own time.

    Raises InputError when it is damaged, or asammdf is not installed.
    """
    asammdf = library("asammdf", path)
    _hush()
    with reading(path, "MDF"), path.open("rb") as raw, asammdf.MDF(raw) as file:
        listed = [each for at, group in enumerate(file.groups) for each in _group(file, at, group)]
        notes = tuple(line for line in str(getattr(file.header, "comment", "")).splitlines() if line.strip())
    places: dict[str, tuple[int, int]] = {}
    signals: list[Signal] = []
    for name, (signal, at) in zip(unique([each.name for each, _ in listed]), listed, strict=True):
        places[name] = at
        signals.append(Signal(name, signal.unit, signal.rows, axis=signal.axis, numeric=signal.numeric))

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        with reading(path, "MDF"), _bounded() as room, path.open("rb") as raw, asammdf.MDF(raw) as file:
            arrays, whole = {}, Whole()
            for name in names:
                group, index = places[name]
                room.left = _declared(file, path, group, index, len(names))
                count = -1 if most is None else most
                samples = file.get(group=group, index=index, samples_only=True, record_count=count if most else None)[0]
                arrays[name] = whole.floats(name, np.asarray(samples))
        return arrays

    return Source(str(path), "MDF", tuple(signals), load, {}, notes)


def _group(file: Any, at: int, group: Any) -> list[tuple[Signal, tuple[int, int]]]:
    """Return the signals of a group and their places; the group's name is that of its acquisition."""
    about = group.channel_group
    name = str(getattr(about, "acq_name", "") or "") or f"group {at + 1}"
    rows = int(getattr(about, "cycles_nr", 0))
    master = file.masters_db.get(at)
    axis = "" if master is None else f"{name}/{group.channels[master].name}"
    found = []
    for index, channel in enumerate(group.channels):
        unit = str(getattr(channel, "unit", "") or "") or ("s" if index == master else "")
        kinds = getattr(channel, "dtype_fmt", None)
        numeric = kinds is None or (kinds.kind in "biuf" and not kinds.shape)
        own = "" if index == master else axis
        found.append((Signal(f"{name}/{channel.name}", unit, rows, axis=own, numeric=numeric), (at, index)))
    return found


def _declared(file: Any, path: Path, at: int, index: int, count: int) -> int:
    """Return how many bytes the blocks of a group declare that they unpack to.

    Raises InputError when its signals take too much memory, or a conversion formula is more than arithmetic.
    """
    group = file.groups[at]
    sizes = [int(block.original_size or block.compressed_size or 0) for block in group.get_data_blocks()]
    about = group.channel_group
    own = int(getattr(about, "samples_byte_nr", 1))
    record = max(own + int(getattr(about, "invalidation_bytes_nr", 0) or 0), 1)
    rows = max(int(getattr(about, "cycles_nr", 0)), sum(sizes) // record)
    refuse_large(path, [rows] * count, COPIES * (max(sizes, default=0) + record))
    if rows * record > max(sum(sizes), record) * 2 or any(end > own for end in _ends(file, group)):
        raise ValueError("channels and records do not fit together")  # asammdf reads beyond them
    channel = group.channels[index]
    for formula in _formulas(getattr(channel, "conversion", None), 0):
        if len(formula) > LONGEST or not _ARITHMETIC.fullmatch(formula):
            remedy = "export values, not formulas"
            raise InputError(Fault(channel.name, f"is the value of a formula: {formula[:60]!r}", remedy, str(path)))
    return sum(sizes)


def _ends(file: Any, group: Any) -> Iterator[int]:
    """Iterate over the end of each channel within a record [bytes]."""
    for info in getattr(file, "_mdf", file)._prepare_record(group):
        if info is not None:
            kind, size, begin, _ = info
            yield max(int(size), kind.itemsize) + int(begin)


def _formulas(conversion: Any, depth: int) -> Iterator[str]:
    """Iterate over the formulas of a conversion and of those that it refers to; asammdf has Python evaluate them."""
    if conversion is None or depth > DEEPEST:
        return
    yield from filter(None, [str(getattr(conversion, "formula", "") or "").strip()])
    for other in (getattr(conversion, "referenced_blocks", None) or {}).values():
        if not isinstance(other, str | bytes):
            yield from _formulas(other, depth + 1)


class _Room:
    """Remaining bytes that blocks may unpack to; the declared sizes may be too small."""

    left = 0

    def unpack(self, codec: str, data: Any) -> bytes:
        """Return the content of a block.

        Raises ValueError when it is longer than all blocks of its group declare.
        """
        if codec == "deflate":
            found = zlib.decompressobj().decompress(data, self.left + 1)
        else:
            import pyarrow as pa

            found = pa.CompressedInputStream(pa.BufferReader(data), codec).read(self.left + 1)
        self.left -= len(found)
        if self.left < 0:
            raise ValueError("a block unpacks to more than it declares")
        return found


@contextmanager
def _bounded() -> Iterator[_Room]:
    """Have asammdf unpack blocks within bounds."""
    from asammdf.blocks import utils
    from asammdf.blocks import v4_constants as names

    room = _Room()
    codecs = {"DEFLATE": "deflate", "TRANSPOSED": "deflate", "LZ": "lz4", "LZ_TRANSPOSED": "lz4"}
    codecs |= {"ZSTD": "zstd", "ZSTD_TRANSPOSED": "zstd"}
    own = dict(utils.DECOMPRESS_FUNC_MAP)
    for name, codec in codecs.items():
        utils.DECOMPRESS_FUNC_MAP[getattr(names, f"DZ_BLOCK_{name}")] = partial(room.unpack, codec)
    try:
        yield room
    finally:
        utils.DECOMPRESS_FUNC_MAP.update(own)


def _hush() -> None:
    """Suppress the message of asammdf on stderr when it closes a file that it could not open."""
    from asammdf.blocks import mdf_v3, mdf_v4

    def go(self: Any) -> None:
        with suppress(Exception):
            self.close()

    mdf_v3.MDF3.__del__ = go
    mdf_v4.MDF4.__del__ = go
