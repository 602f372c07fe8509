"""Where contact is lost and regained along the axis that a sweep follows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError

if TYPE_CHECKING:
    import xarray


def thresholds(data: xarray.Dataset) -> xarray.Dataset:
    """Return the values of the followed axis, and Λ, at which rattle begins on the way up and ends on the way down.

    The threshold lies between two values of the grid: given are their middle and, as ``within``, half their distance.
    NaN where the motion rattles, or holds contact, all the way.

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
    along = [str(name) for name in data["status"].dims if name != "period"][-1]
    rattles = data["regime"] > 0
    values = data[along].values
    others = tuple(name for name in data["regime"].dims if name not in ("direction", along))
    found = {}
    for way in ("up", "down"):
        lively = rattles.sel(direction=way).transpose(*others, along).values
        push = data["excitation"].sel(direction=way).transpose(*others, along).values
        place = np.argmax(lively, axis=-1) if way == "up" else _lowest_of_the_upper(lively)
        crossed = lively.any(axis=-1) & ~lively[..., 0] & (place > 0)
        below = np.maximum(place - 1, 0)
        middle = np.where(crossed, 0.5 * (values[below] + values[place]), np.nan)
        within = np.where(crossed, 0.5 * (values[place] - values[below]), np.nan)
        pick = [np.take_along_axis(push, at[..., None], axis=-1)[..., 0] for at in (below, place)]
        names = (way, f"within_{way}", f"excitation_{way}")
        found |= dict(zip(names, (middle, within, np.where(crossed, 0.5 * (pick[0] + pick[1]), np.nan)), strict=True))
    coordinates = {name: data[name] for name in others}
    return xarray.Dataset({name: (others, value) for name, value in found.items()}, coordinates, {"along": along})


def _lowest_of_the_upper(lively: np.ndarray) -> np.ndarray:
    """Return the first place from which on rattle lasts to the upper end, the last place where it does not."""
    quiet = ~lively[..., ::-1]
    run = np.where(quiet.any(axis=-1), np.argmax(quiet, axis=-1), lively.shape[-1])
    return np.minimum(lively.shape[-1] - run, lively.shape[-1] - 1)
