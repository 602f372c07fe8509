"""Unchecked content of a file: channels with the contract's names in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.source import Source

# Names that a file without a map must have one of.
CONTRACT = ("time_s", "theta_drive_rad", "theta_loose_rad", "theta_rad", "omega_rad_s")


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels of one file as they were read: nothing is checked, nothing is corrected.

    Args:
        columns: by name of the contract (``time_s``, ``theta_drive_rad``, ``theta_loose_rad``, or what else the file
            has), SI units, each (n,); they may hold NaN, and time need not rise.
        file: where they came from.
        meta: what the file or its map tells besides.
        condition: keys of the rig that this record overrides, dotted, with TOML values: ``{"motion.mean": "180 rpm"}``.
    """

    columns: dict[str, np.ndarray]
    file: str = ""
    meta: dict[str, Any] = field(default_factory=dict)
    condition: dict[str, Any] = field(default_factory=dict)


def read(path: str | Path, map_file: str | Path | None = None) -> Channels:
    """Read the channels of a file.

    Args:
        path: a measured file of any format that is read, the folder of a recording, or a map that names one file.
        map_file: ``record.toml`` that tells names, units and ratio signs of the channels.

    Returns:
        The channels, unchecked. Without a map every column of numbers, by the names of the file; with one, those
        that it names.

    Raises:
        InputError: it is not there, cannot be read, or lacks what the map names; lists what it has.
    """
    from gears3d.measured.readers.formats import open_source
    from gears3d.measured.readers.maps import flat, load_map, named_files

    path = Path(path)
    if map_file is None and path.suffix.lower() == ".toml":
        files = named_files(path)
        if len(files) > 1:
            names = ", ".join(file.name for file in files)
            raise InputError(Fault("record", f"names several files: {names}", "give one of them and --map", str(path)))
        path, map_file = files[0], path
    if map_file is None:
        return _as_named(open_source(path))
    from gears3d.measured.readers.mapping import Mapper

    chart = load_map(Path(map_file), path)
    mapper = Mapper(open_source(path), chart, str(map_file))
    columns = mapper.columns()
    told = {"title": chart.title} if chart.title else {}
    found = Channels(columns, str(path), mapper.meta | told, flat(chart.condition))
    return within(found, mapper.span(), "time.from, time.to")


# First and last time of the part of a record that is used [s]; ``None``: from its beginning, to its end.
Span = tuple[float | None, float | None]


def within(channels: Channels, span: Span, keys: str = "--from, --to") -> Channels:
    """Return the part of a record between two of its own times; the metadata records which part.

    Args:
        channels: the record, unchecked.
        span: first and last time [s].
        keys: named in the fault: what gave the times.

    Raises:
        InputError: there are no rows between these times.

    >>> rows = Channels({"time_s": np.array([0.0, 1.0, 2.0, 3.0])})
    >>> within(rows, (1.0, None)).columns["time_s"].tolist()
    [1.0, 2.0, 3.0]
    """
    time = channels.columns.get("time_s")
    if span == (None, None) or time is None or not np.any(np.isfinite(time)):
        return channels
    low, high = (-np.inf if span[0] is None else span[0]), (np.inf if span[1] is None else span[1])
    inside = (time >= low) & (time <= high)
    first, last = float(np.nanmin(time)), float(np.nanmax(time))
    if not inside.any():
        asked = (
            "the beginning" if span[0] is None else f"{low:.6g} s",
            "the end" if span[1] is None else f"{high:.6g} s",
        )
        what = f"has 0 rows from {asked[0]} to {asked[1]}, the record covers {first:.6g} to {last:.6g} s"
        raise InputError(Fault(keys, what, "give times within the record, in its own time", channels.file))
    columns = {
        name: values[inside] if np.shape(values)[:1] == time.shape else values
        for name, values in channels.columns.items()
    }
    used = columns["time_s"]
    text = f"{used[0]:.6g} to {used[-1]:.6g} s of {first:.6g} to {last:.6g} s are used, "
    text += f"{len(used)} of {len(time)} rows"
    note = {"kind": "part-used", "channel": "time_s", "size": float(len(used)), "unit": "row", "text": text}
    meta: Mapping[str, Any] = channels.meta
    decoded = [*meta.get("decoded", []), note | {"harmless": False}]
    return replace(channels, columns=columns, meta={**meta, "span_s": span, "decoded": decoded})


def _as_named(source: Source) -> Channels:
    """Return the columns of a file whose names are those of the contract."""
    own = {each.bare: each for each in source.signals if each.bare in CONTRACT}
    if not own:
        remedy = f"write a record.toml, or let `gears3d inspect FILE --guess` propose one; {source.listing()}"
        raise InputError(Fault("time_s", "is missing: no channel has a name of the contract", remedy, source.file))
    group = next(iter(own.values())).name.rpartition("/")[0]
    rows = next(iter(own.values())).rows
    kept = [
        each
        for each in source.signals
        if each.bare in own or (each.numeric and each.rows == rows and each.name.rpartition("/")[0] == group)
    ]
    loaded = source.load([each.name for each in kept], None)
    if "time_s" in own:
        loaded = source.without_gaps(loaded)
    meta = dict(source.meta)
    source.remarked(meta)
    return Channels({each.bare: loaded[each.name] for each in kept}, source.file, meta)
