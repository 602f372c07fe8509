"""Tooth stiffness by the approximate formulas of ISO 6336-1, method B."""

from __future__ import annotations

from math import cos, degrees
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair

THEORY_TO_MEASUREMENT = 0.8
"""C_M, which corrects the theoretical single stiffness of solid discs to the measured one."""


def iso_single_stiffness(pair: Pair, correction: float = THEORY_TO_MEASUREMENT) -> float:
    """Return the largest stiffness c' of one pair of teeth of solid steel gears under a load of 100 N/mm or more.

    1/c'th = 0.04723 + 0.15551/zn1 + 0.25791/zn2 − 0.00635·x1 − 0.11654·x1/zn1 − 0.00193·x2 − 0.24188·x2/zn2
    + 0.00529·x1² + 0.00182·x2² [mm·µm/N] and c' = c'th·C_M·C_B·cos β with C_B for the basic rack.

    Args:
        pair: the pair.
        correction: C_M; 1 for the theoretical stiffness.

    Returns:
        Stiffness for a unit of face width [N/m²].

    Source: ISO 6336-1:2006, section 9.3.1.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, dedendum=1.2)
    >>> round(iso_single_stiffness(Pair.from_backlash(gear, gear, 1e-4)) / 1e9, 2)
    13.11
    """
    drive, loose = pair.drive, pair.loose
    first, second = (_virtual_teeth(gear) for gear in (drive, loose))
    x1, x2 = drive.profile_shift, loose.profile_shift
    flexibility = 0.04723 + 0.15551 / first + 0.25791 / second - 0.00635 * x1 - 0.11654 * x1 / first
    flexibility += -0.00193 * x2 - 0.24188 * x2 / second + 0.00529 * x1**2 + 0.00182 * x2**2
    rack = 0.5 * sum((1.0 + 0.5 * (1.2 - gear.dedendum)) for gear in (drive, loose))
    rack *= 1.0 - 0.02 * (20.0 - degrees(drive.pressure_angle))
    return 1e9 / flexibility * correction * rack * cos(drive.helix_angle)


def iso_mesh_stiffness(pair: Pair, correction: float = THEORY_TO_MEASUREMENT) -> float:
    """Return the mean mesh stiffness c_γα·b, c_γα = c'·(0.75·ε_α + 0.25), along the transverse line of action [N/m].

    Args:
        pair: the pair.
        correction: C_M; 1 for the theoretical stiffness.

    Source: ISO 6336-1:2006, section 9.3.2.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, face_width=0.01)
    >>> round(iso_mesh_stiffness(Pair.from_backlash(gear, gear, 1e-4)) / 1e6)
    184
    """
    width = min(pair.drive.face_width, pair.loose.face_width)
    return width * iso_single_stiffness(pair, correction) * (0.75 * pair.contact_ratio + 0.25)


def _virtual_teeth(gear: Gear) -> float:
    """Teeth of the spur gear that fits the normal section, zn = z/(cos²βb·cos β); ISO 21771."""
    return gear.teeth / (cos(gear.base_helix_angle) ** 2 * cos(gear.helix_angle))
