"""Where contact is lost and regained along the axis that a sweep follows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError

if TYPE_CHECKING:
    import xarray


def thresholds(data: xarray.Dataset) -> xarray.Dataset:
    """Return the values of the followed axis, and Λ, at which rattle begins or ends on the way up and on the way down.

    On a way that begins in contact it is the first place that rattles, on one that begins with rattle the place from
    which on contact holds. It lies between two values of the grid: given are their middle and, as ``within``, half
    their distance. NaN where contact holds all the way, or rattle is there at both ends.

    Args:
        data: of a sweep with ``follow``, and the measures ``regime`` and ``threshold``.

    Returns:
        ``up``, ``down``, ``within_up``, ``within_down``, ``excitation_up``, ``excitation_down`` over the other axes.

    Raises:
        InputError: nothing was followed, or the measures are missing.

    Source: Rigaud & Perret-Liaudet 2020, section 4: the rise and the collapse of rattle.
    """
    import xarray

    if "direction" not in data.dims or "regime" not in data or "excitation" not in data:
        raise InputError(Fault("sweep", "has no thresholds", "give --follow KEY, and --measure regime,threshold"))
    along = [str(name) for name in data["status"].dims][-1]
    others = tuple(name for name in data["regime"].dims if name not in ("direction", along))
    found = {}
    for way in ("up", "down"):
        order = slice(None) if way == "up" else slice(None, None, -1)
        part = data.sel(direction=way).transpose(*others, along, ...).isel({along: order})
        before, crossed = _crossing(part["regime"].values > 0)
        values, push = (
            np.broadcast_to(part[along].values, (*crossed.shape, part.sizes[along])),
            part["excitation"].values,
        )
        ends = [[_pick(table, before + step) for step in (0, 1)] for table in (values, push)]
        middle, within = 0.5 * (ends[0][0] + ends[0][1]), 0.5 * np.abs(ends[0][1] - ends[0][0])
        told = (middle, within, 0.5 * (ends[1][0] + ends[1][1]))
        names = (way, f"within_{way}", f"excitation_{way}")
        found |= {name: np.where(crossed, value, np.nan) for name, value in zip(names, told, strict=True)}
    coordinates = {name: data[name] for name in others}
    return xarray.Dataset({name: (others, value) for name, value in found.items()}, coordinates, {"along": along})


def _crossing(lively: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the place before which a way crosses the threshold, and whether it does; the way is the last axis."""
    size = lively.shape[-1]
    first, last = np.argmax(lively, axis=-1), size - 1 - np.argmax(lively[..., ::-1], axis=-1)
    begins, ends = lively[..., 0], lively[..., -1]
    rises, falls = lively.any(axis=-1) & ~begins, begins & ~ends
    before = np.where(rises, first - 1, np.where(falls, last, 0))
    return np.clip(before, 0, max(size - 2, 0)), (rises | falls) & (size > 1)


def _pick(table: np.ndarray, place: np.ndarray) -> np.ndarray:
    return np.take_along_axis(table, np.minimum(place, table.shape[-1] - 1)[..., None], axis=-1)[..., 0]
