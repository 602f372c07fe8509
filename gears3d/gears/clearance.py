"""What eccentric, wobbling and misaligned axes leave of the dead band and of the contact ratio."""

from __future__ import annotations

from math import pi, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.involute import inv
from gears3d.gears.mounting import Eccentricity, Misalignment, Wobble

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]

_ANGLES = 96
"""In one revolution."""
_HEIGHTS = np.linspace(-0.5, 0.5, 9)


def mounted_band(pair: Pair) -> tuple[float, float]:
    """Return the narrowest dead band and the largest distance of the teeth's axes over all positions of the gears.

    In every section the flanks are involutes about displaced axes, for which both are closed forms; the band ends where
    the first section touches. Crowning and the gears' helix slope count, deviations do not.

    Args:
        pair: the pair, with its mounting.

    Returns:
        Width of the dead band [m], negative where the gears jam, and distance [m].

    >>> from gears3d.gears import Eccentricity, Gear, Pair
    >>> gear = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
    >>> pair = Pair.from_backlash(gear, gear, 250e-6).with_mounting(Eccentricity("drive", 50e-6))
    >>> round(mounted_band(pair)[0] * 1e6, 1)
    215.5
    """
    total, width = pair.drive.base_radius + pair.loose.base_radius, min(pair.drive.face_width, pair.loose.face_width)
    drive, loose = _angles(pair)
    first, last = np.full(drive.shape, -np.inf), np.full(drive.shape, np.inf)
    farthest = 0.0
    for z in _HEIGHTS * width:
        x, y = _axes(pair, drive, loose, float(z))
        distance = np.hypot(x, y)
        angle = np.arccos(np.minimum(total / distance, 1.0))
        wider = total * (np.tan(angle) - angle - inv(pair.working_pressure_angle))
        aside = -total * np.arctan2(y, x)
        lean = sum(gear.helix_slope * z / gear.face_width for gear in (pair.drive, pair.loose))
        lean_off = sum(gear.lead_crowning * (2.0 * z / gear.face_width) ** 2 for gear in (pair.drive, pair.loose))
        first = np.maximum(first, aside - wider + lean - lean_off)
        last = np.minimum(last, aside + wider + lean + lean_off + pair.backlash)
        farthest = max(farthest, float(distance.max()))
    return float(np.min(last - first)), farthest


def _angles(pair: Pair) -> tuple[Array, Array]:
    """Angles of both gears in all positions in which their teeth can meet; many ratios come near to every position."""
    turns = np.lcm(pair.drive.teeth, pair.loose.teeth) // pair.drive.teeth
    if turns > 12:
        once = np.linspace(0.0, 2.0 * pi, _ANGLES, endpoint=False)
        drive, loose = np.meshgrid(once, once)
        return drive.ravel(), loose.ravel()
    drive = np.linspace(0.0, 2.0 * pi * turns, turns * _ANGLES, endpoint=False)
    return drive, drive * pair.drive.teeth / pair.loose.teeth


def _axes(pair: Pair, drive: Array, loose: Array, z: float) -> tuple[Array, Array]:
    """Position of the loose gear's teeth's axis from that of the drive's in a section [m]."""
    x, y = np.full(drive.shape, pair.centre_distance), np.zeros(drive.shape)
    for item in pair.mounting:
        if isinstance(item, Misalignment):
            x, y = x + tan(item.in_plane) * z, y + tan(item.out_of_plane) * z
            continue
        size = item.offset if isinstance(item, Eccentricity) else tan(item.angle) * z
        turn = (drive if item.gear == "drive" else loose) + item.phase
        x = x - size * np.cos(turn)
        y = y + (-size if item.gear == "drive" else size) * np.sin(turn)
    return x, y


def check_mounting(pair: Pair, taken: float) -> None:
    """Refuse a mounting that jams the gears or lets teeth lose contact.

    Args:
        pair: the pair, with its mounting.
        taken: by how much deviations of the flanks narrow the dead band [m].

    Raises:
        InputError: naming what the mounting leaves.
    """
    left, farthest = mounted_band(pair)
    if left - taken < 0.0:
        raise InputError(
            Fault(
                "backlash",
                f"is {pair.backlash * 1e6:.6g} um, of which the mounting takes {(pair.backlash - left) * 1e6:.4g} um "
                + (f"and deviations of the flanks {taken * 1e6:.4g} um " if taken else "")
                + "where it is least: the gears would jam",
                "give more backlash, or smaller offsets and tilts",
            )
        )
    total = pair.drive.base_radius + pair.loose.base_radius
    reach = sum(gear.base_radius * gear.tip_roll for gear in (pair.drive, pair.loose))
    ratio = (reach - (farthest**2 - total**2) ** 0.5) / pair.drive.base_pitch
    if ratio + pair.overlap_ratio < 1.0:
        kinds = sorted({type(item).__name__ for item in pair.mounting if isinstance(item, Eccentricity | Wobble)})
        raise InputError(
            Fault(
                "centre_distance",
                f"is {pair.centre_distance * 1e3:.6g} mm and grows to {farthest * 1e3:.6g} mm by the mounting "
                f"({', '.join(kinds) or 'Misalignment'}): the contact ratio falls to {ratio:.3f} there",
                "give a smaller centre distance or backlash, smaller offsets and tilts, or longer teeth",
            )
        )
