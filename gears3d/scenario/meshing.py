"""From gears and mounting to a meshing pair, and to what its solids weigh."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair
    from gears3d.scenario.model import Gears, Mount


def mesh(gears: Gears, mount: Mount) -> Pair:
    """Return the pair of two gears, mounted, with the deviations of their profiles.

    Args:
        gears: both gears.
        mount: misalignment, and backlash, centre distance, or both (then the teeth are thinned to fit).

    Raises:
        InputError: they do not mesh.
    """
    drive, loose = gears.drive, gears.loose
    pair = _apart(drive.gear(), loose.gear(), mount.centre_distance, mount.backlash)
    if drive.deviations or loose.deviations:
        pair = pair.with_deviations(*drive.deviations, *loose.deviations)
    tilted = () if mount.misalignment is None else (mount.misalignment,)
    mounting = (*drive.mounting, *loose.mounting, *tilted)
    return pair.with_mounting(*mounting) if mounting else pair


@lru_cache(maxsize=64)
def _apart(drive: Gear, loose: Gear, centre_distance: float | None, backlash: float | None) -> Pair:
    """Return the pair at its centre distance; one that was asked for before has its checks behind it."""
    from gears3d.gears.pair import Pair

    if centre_distance is None:
        assert backlash is not None
        return Pair.from_backlash(drive, loose, backlash)
    if backlash is None:
        return Pair.from_centre_distance(drive, loose, centre_distance)
    return Pair.from_both(drive, loose, centre_distance, backlash)


def solid_inertia(pair: Pair, which: str, density: float) -> float:
    """Return the moment of inertia of a gear's solid about its axis [kg·m²].

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        density: kg/m³.

    Returns:
        Polar moment of the transverse section, bore and pockets beside the web taken off, times density and face width;
        slices that are turned against each other, as a helix does, have the same.
    """
    from math import pi

    import numpy as np

    from gears3d.gears.outline import outline

    gear = pair.gear(which)
    x, y = outline(pair, which, chord=0.05e-6, root_chord=0.05e-6).points.reshape(-1, 2).T
    x_next, y_next = np.roll(x, -1), np.roll(y, -1)
    squares = x * x + x * x_next + x_next * x_next + y * y + y * y_next + y_next * y_next
    section = float(np.sum((x * y_next - x_next * y) * squares)) / 12
    hole = pi / 2 * (0.5 * (gear.bore or 0.0)) ** 4
    moment = gear.face_width * (section - hole)
    if gear.pocket and gear.web is not None:
        hub, rim = gear.pocket
        moment -= (gear.face_width - gear.web) * pi / 2 * (rim**4 - hub**4)
    return density * moment
