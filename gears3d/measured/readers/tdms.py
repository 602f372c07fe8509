"""NI TDMS, by npTDMS, a chunk at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.measured.readers.foreign import library, reading
from gears3d.measured.readers.source import Signal, Source, Whole, refuse_large, seconds


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
