"""Columns for rerun: times, turning transforms, and marks that come and go."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import rerun as rr

TIMELINE = "sim_time"
IMPACT = "impact"


def clock(time: np.ndarray) -> rr.TimeColumn:
    """Return the column of simulated time, whole nanoseconds.

    Args:
        time: [s], (n,).
    """
    return rr.TimeColumn(TIMELINE, duration=np.round(np.asarray(time) * 1e9).astype("timedelta64[ns]"))


def scalars(rec: rr.RecordingStream, entity: str, time: np.ndarray, values: np.ndarray) -> None:
    """Write a curve, or several that share their times.

    Args:
        rec: recording being written.
        entity: path of the entity.
        time: [s], (n,).
        values: (n,) or (n, series).
    """
    columns = rr.Scalars.columns(scalars=np.ascontiguousarray(values, dtype=np.float64).ravel())
    if values.ndim == 2:
        columns = columns.partition(np.full(len(values), values.shape[1]))
    rec.send_columns(entity, indexes=[clock(time)], columns=columns)


def turn(rec: rr.RecordingStream, entity: str, time: np.ndarray, angle: np.ndarray) -> None:
    """Write a rotation about +z.

    Args:
        rec: recording being written.
        entity: path of the entity.
        time: [s], (n,).
        angle: [rad], (n,).
    """
    half = 0.5 * np.mod(angle, 4.0 * np.pi)
    quaternion = np.zeros((len(time), 4), dtype=np.float32)
    quaternion[:, 2], quaternion[:, 3] = np.sin(half), np.cos(half)
    rec.send_columns(entity, indexes=[clock(time)], columns=rr.Transform3D.columns(quaternion=quaternion))


def marks(
    rec: rr.RecordingStream,
    entity: str,
    time: np.ndarray,
    counts: np.ndarray,
    columns: Iterable[Any],
) -> None:
    """Write marks of which ``counts[i]`` are there from ``time[i]`` on; rows that change nothing are left out.

    Args:
        rec: recording being written.
        entity: path of the entity.
        time: [s], (n,).
        counts: (n,), 0 clears what was there.
        columns: made by ``columns`` of an archetype from as many instances as the counts add up to.
    """
    keep = (counts > 0) | (np.r_[1, counts[:-1]] > 0)
    parts = [column.partition(counts[keep]) for column in columns]
    rec.send_columns(entity, indexes=[clock(time[keep])], columns=[c for part in parts for c in part])
