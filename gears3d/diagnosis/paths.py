"""Paths of records without segmentation, each computed once: contact episodes and segmentation begin with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.measured.segmentation import Track, path_of
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted

# Rows above which a path is not cached, because of its memory.
LONG = 1 << 20


class Paths:
    """Paths of the records of one diagnosis."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, float], tuple[Admitted, Track]] = {}

    def of(self, one: Admitted, delay: float = 0.0) -> Track:
        """Return displacement and angles of a record without a delay [s] of the loose gear's readings.

        delay: [s].

        Raises:
            InputError: there are too few readings, or a gear stands still.
        """
        key = (id(one), delay)
        if key in self._known:
            return self._known[key][1]
        record = one.recording if delay == 0.0 else _read_in_time(one.recording, delay)
        known = path_of(record, one.rig, one.file)
        if len(record.time) <= LONG:
            self._known[key] = (one, known)  # with the record: while it is held, no other has its id
        return known


def _read_in_time(record: Recording, delay: float) -> Recording:
    """Return a record without a delay of the loose gear's readings, shortened by it.

    The loose gear is shifted by whole rows, so that its noise is unchanged; fractions of a row shift the drive, which
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
