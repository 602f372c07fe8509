"""ASAM MDF, versions 3 and 4, by asammdf."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.readers.foreign import library, reading
from gears3d.readers.source import Signal, Source, unique


def open_mdf(path: Path) -> Source:
    """Open an MDF file; each group has its own time.

    Args:
        path: the file.

    Raises:
        InputError: it is damaged, or asammdf is not installed.
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
        with reading(path, "MDF"), path.open("rb") as raw, asammdf.MDF(raw) as file:
            arrays = {}
            for name in names:
                group, index = places[name]
                count = -1 if most is None else most
                samples = file.get(group=group, index=index, samples_only=True, record_count=count if most else None)[0]
                arrays[name] = np.asarray(samples, dtype=np.float64)
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


def _hush() -> None:
    """Let files that could not be opened go in silence; asammdf closes what it never made, and says so on stderr."""
    from asammdf.blocks import mdf_v3, mdf_v4

    def go(self: Any) -> None:
        with suppress(Exception):
            self.close()

    mdf_v3.MDF3.__del__ = go
    mdf_v4.MDF4.__del__ = go
