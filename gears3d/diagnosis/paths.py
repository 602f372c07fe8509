"""Uncut paths of records, each worked out once: visits to the flanks, cutting and cutting anew all begin with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.measured.segmentation import Track, path_of
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted

LONG = 1 << 20
"""Rows from which on a path is not kept: a long record has no room for much beside it."""


class Paths:
    """Paths of the records of one diagnosis."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, float], tuple[Admitted, Track]] = {}

    def of(self, one: Admitted, delay: float = 0.0) -> Track:
        """Return displacement and angles of a record, as if the loose gear had been read in time with the drive.

        Args:
            one: the record.
            delay: of the loose gear's readings [s].

        Raises:
            InputError: there are too few readings, or a gear stands still.
        """
        key = (id(one), delay)
        if key in self._known:
            return self._known[key][1]
        record = one.recording if delay == 0.0 else _read_in_time(one.recording, delay)
        known = path_of(record, one.rig, one.file)
        if len(record.time) <= LONG:
            self._known[key] = (one, known)  # with the record: as long as it is held, no other has its id
        return known


def _read_in_time(record: Recording, delay: float) -> Recording:
    """Return a record whose loose gear is read earlier by a delay; what is then not known of it is cut off.

    The loose gear is moved by whole rows, so that its noise stays what it is; parts of a row go to the drive, which
    moves smoothly.
    """
    time = record.time
    spacing = float(np.median(np.diff(time)))
    rows = round(delay / spacing)
    kept = np.arange(max(-rows, 0) + 1, len(time) - max(rows, 0) - 1)
    drive = np.interp(time[kept] - (delay - rows * spacing), time, record.signals["theta_drive_rad"])
    signals = {name: values[kept] for name, values in record.signals.items()}
    signals |= {"theta_drive_rad": drive, "theta_loose_rad": record.signals["theta_loose_rad"][kept + rows]}
    return Recording(signals, meta=record.meta)
