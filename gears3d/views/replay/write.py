"""rerun, imported on first use, and its columns: times, turning transforms, marks that come and go."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.extras import Late, require
from gears3d.files import replacing

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb
else:
    rr = Late("rerun", "a replay", "replay")
    rrb = Late("rerun.blueprint", "a replay", "replay")

__all__ = ["require_rerun", "rr", "rrb"]


def require_rerun() -> None:
    """Refuse early where rerun is not installed."""
    require("rerun", "a replay", "replay")


APPLICATION = "gears3d"
BACKGROUND = [0x16, 0x18, 0x1D]
"""Of the pictures."""

TIMELINE = "sim_time"
IMPACT = "impact"


@contextmanager
def film(target: Path, arranged: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """Open a recording under a temporary name, which is renamed when all is written."""
    with replacing(target) as unfinished:
        try:
            with rr.RecordingStream(APPLICATION) as rec:
                rec.save(unfinished, default_blueprint=arranged)
                yield rec
                rec.flush()
        except RuntimeError as error:  # what the recorder raises when a disk is full
            raise OSError(str(error)) from error


def clock(time: np.ndarray) -> rr.TimeColumn:
    """Return the column of simulated time, whole nanoseconds."""
    return rr.TimeColumn(TIMELINE, duration=np.round(np.asarray(time) * 1e9).astype("timedelta64[ns]"))


def scalars(rec: rr.RecordingStream, entity: str, time: np.ndarray, values: np.ndarray) -> None:
    """Write a curve, or several that share their times."""
    columns = rr.Scalars.columns(scalars=np.ascontiguousarray(values, dtype=np.float64).ravel())
    if values.ndim == 2:
        columns = columns.partition(np.full(len(values), values.shape[1]))
    rec.send_columns(entity, indexes=[clock(time)], columns=columns)


def turn(rec: rr.RecordingStream, entity: str, time: np.ndarray, angle: np.ndarray) -> None:
    """Write a rotation about +z."""
    half = 0.5 * np.mod(angle, 4.0 * np.pi)
    quaternion = np.zeros((len(time), 4), dtype=np.float32)
    quaternion[:, 2], quaternion[:, 3] = np.sin(half), np.cos(half)
    rec.send_columns(entity, indexes=[clock(time)], columns=rr.Transform3D.columns(quaternion=quaternion))


def marks(rec: rr.RecordingStream, entity: str, time: np.ndarray, counts: np.ndarray, columns: Iterable[Any]) -> None:
    """Write marks of which ``counts[i]`` are there from ``time[i]`` on; rows that change nothing are left out."""
    keep = (counts > 0) | (np.r_[1, counts[:-1]] > 0)
    parts = [column.partition(counts[keep]) for column in columns]
    rec.send_columns(entity, indexes=[clock(time[keep])], columns=[c for part in parts for c in part])


def trail(
    time: np.ndarray, life: float, levels: int, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what is seen of events that fade: a row whenever one comes, fades by a level or goes.

    >>> rows = trail(np.array([0.0, 0.3]), life=0.4, levels=2, most=5)
    >>> [part.tolist() for part in (rows[0].round(3), *rows[1:])]
    [[0.0, 0.2, 0.3, 0.4, 0.5, 0.7], [1, 1, 2, 1, 1, 0], [0, 0, 0, 1, 1, 1], [0, 1, 1, 0, 0, 1]]
    """
    tick = max(round(life / levels * 1e9), 1)
    born = np.round(np.asarray(time) * 1e9).astype(np.int64)
    at = np.unique(born[:, None] + tick * np.arange(levels + 1))
    end = np.searchsorted(born, at, side="right")
    begin = np.maximum(np.searchsorted(born, at - tick * levels, side="right"), end - most)
    counts = end - begin
    which = np.repeat(begin, counts) + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    level = (np.repeat(at, counts) - born[which]) // tick
    return at * 1e-9, counts, which, level
