"""Universal files: data sets 58 and 58b, by pyuff."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.inputs import refuse_beyond
from gears3d.measured.readers.foreign import library, reading
from gears3d.measured.readers.source import Signal, Source, unique

# Bytes of memory for a byte of the file: pyuff keeps lines and numbers as objects of Python.
GROWTH = 12


def open_uff(path: Path) -> Source:
    """Open a universal file; every data set 58 is a signal, with its abscissa as time.

    Raises InputError when it is damaged, has no data set 58, or pyuff is not installed.
    """
    pyuff = library("pyuff", path)
    refuse_beyond(GROWTH * path.stat().st_size, path, "its data sets", "export fewer functions into one file")
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
