"""Files of loggers: ASAM MDF by asammdf, NI TDMS by npTDMS, universal files by pyuff, WAV by scipy."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.inputs import refuse_beyond
from gears3d.measured.readers.source import Signal, Source, Whole, library, reading, refuse_large, seconds, unique

# Copies of the largest block in memory while asammdf decodes it.
COPIES = 6
# Characters of a formula, and conversions that refer to one another.
LONGEST, DEEPEST = 200, 8
_ARITHMETIC = re.compile(
    r"(?:\s|[-+*/()](?!\*)|X1?(?:\s?\*\*\s?[0-9](?![0-9.eE*]))?|(?:[0-9]{1,20}\.?[0-9]{0,20}|\.[0-9]{1,20})"
    r"(?:[eE][-+]?[0-9]{1,3})?|(?:sin|cos|tan|sqrt|exp|log|log10|abs)(?=\s*\())*"
)
# Bytes of memory for a byte of the file: pyuff keeps lines and numbers as objects of Python.
UFF_GROWTH = 12
# Bytes of memory for a byte of the file: 24 bits are unpacked to 32.
WAV_GROWTH = 4


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


def open_tdms(path: Path) -> Source:
    """Open a TDMS file; waveform properties give the time of a channel.

    Raises InputError when it is damaged, or npTDMS is not installed.
    """
    nptdms = library("nptdms", path)
    places: dict[str, tuple[str, str]] = {}
    signals: list[Signal] = []
    with reading(path, "TDMS"), path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:
        notes = [f"{key} = {value}" for key, value in file.properties.items()]
        for group in file.groups():
            notes += [f"{group.name}.{key} = {value}" for key, value in group.properties.items()]
            for channel in group.channels():
                signal = _signal(group.name, channel)
                places[signal.name] = (group.name, channel.name)
                signals.append(signal)

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        with reading(path, "TDMS"), path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:
            channels = {name: file[places[name][0]][places[name][1]] for name in names}
            refuse_large(path, [len(each) if most is None else min(len(each), most) for each in channels.values()])
            whole = Whole()
            return {name: _values(channel, most, partial(whole.floats, name)) for name, channel in channels.items()}

    return Source(str(path), "TDMS", tuple(signals), load, {}, tuple(notes))


def _signal(group: str, channel: Any) -> Signal:
    told = channel.properties
    step = told.get("wf_increment")
    clock = (float(told.get("wf_start_offset", 0.0)), float(step)) if step else None
    kind = np.dtype(channel.dtype).kind if channel.dtype is not None else "O"
    unit = "s" if kind == "M" else str(told.get("unit_string", "") or told.get("NI_UnitDescription", ""))
    return Signal(f"{group}/{channel.name}", unit, len(channel), clock, numeric=kind in "biufM")


def _values(channel: Any, most: int | None, floats: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    if np.dtype(channel.dtype).kind == "M":
        return seconds(channel[:most])
    values = np.zeros(len(channel) if most is None else min(len(channel), most))
    done = 0
    for chunk in channel.data_chunks():
        part = chunk[:][: len(values) - done]
        values[done : done + len(part)] = floats(part)
        done += len(part)
        if done == len(values):
            break
    return values[:done]


def open_uff(path: Path) -> Source:
    """Open a universal file; every data set 58 is a signal, with its abscissa as time.

    Raises InputError when it is damaged, has no data set 58, or pyuff is not installed.
    """
    pyuff = library("pyuff", path)
    refuse_beyond(UFF_GROWTH * path.stat().st_size, path, "its data sets", "export fewer functions into one file")
    with reading(path, "UFF"):
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(int(at)) for at, kind in enumerate(file.get_set_types()) if int(kind) == 58]
        listed = [(_name(each, at), each) for at, each in enumerate(sets)]
        values = {}
        signals = []
        for name, each in zip(unique([name for name, _ in listed]), sets, strict=True):
            signals += _signals(name, each, values)
    if not sets:
        remedy = "export time histories as functions at nodal degrees of freedom"
        raise InputError(Fault("", "has no data set 58", remedy, str(path)))

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        return {name: values[name][:most].copy() for name in names}

    notes = tuple(str(each.get(key, "")) for each in sets[:1] for key in ("id2", "id3", "id4", "id5"))
    return Source(str(path), "UFF", tuple(signals), load, {}, tuple(note for note in notes if note.strip()))


def _name(each: dict[str, Any], at: int) -> str:
    told = str(each.get("id1", "")).strip().replace("/", "_")
    return told if told and told.upper() != "NONE" else f"set {at + 1}"


def _signals(name: str, each: dict[str, Any], values: dict[str, np.ndarray]) -> list[Signal]:
    """Return the signals of a data set: its ordinate, and its abscissa where that is uneven."""
    data = np.asarray(each["data"])
    numeric = data.dtype.kind in "biuf" and data.ndim == 1
    values[name] = data.astype(np.float64) if numeric else np.zeros(0)
    unit = _unit(each, "ordinate")
    rows = len(values[name])
    if int(each.get("abscissa_spacing", 1)) == 1:
        clock = (float(each.get("abscissa_min", 0.0)), float(each.get("abscissa_inc", 0.0)))
        return [Signal(name, unit, rows, clock if clock[1] > 0.0 else None, numeric=numeric)]
    axis = f"{name}/x"
    values[axis] = np.asarray(each["x"], dtype=np.float64)
    return [Signal(name, unit, rows, axis=axis, numeric=numeric), Signal(axis, _unit(each, "abscissa") or "s", rows)]


def _unit(each: dict[str, Any], which: str) -> str:
    told = str(each.get(f"{which}_axis_units_lab", "") or "").strip()
    return "" if told.upper() in ("NONE", "NO") else told


def open_wav(path: Path) -> Source:
    """Open a WAV file; its channels are ``channel 1``, ``channel 2``, sampled at the rate of its header.

    Raises InputError when it is damaged, or takes too much memory.
    """
    from scipy.io import wavfile

    refuse_beyond(WAV_GROWTH * path.stat().st_size, path, "its samples", "cut the file")
    with reading(path, "WAV"):
        rate, samples = wavfile.read(path)
        table = samples.reshape(len(samples), -1)
        step = 1.0 / rate
    signals = tuple(Signal(f"channel {k + 1}", "", len(table), (0.0, step)) for k in range(table.shape[1]))

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        refuse_large(path, [len(table)] * len(names))
        places = {each.name: k for k, each in enumerate(signals)}
        return {name: table[:most, places[name]].astype(np.float64) for name in names}

    return Source(str(path), "WAV", signals, load)
