"""A seal or brush that sticks to the loose gear, is wound up by it, and slips: a sawtooth torque over its angle."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, torque_harmonic

# Harmonics of the sawtooth. Averaged over the period of the next one (Lanczos), they do not ripple: the torque is the
# sawtooth but for the slips, which take a seventeenth of the angle.
HARMONICS = 16


@register
@dataclass(frozen=True)
class DragStickSlip:
    """Torque C = amplitude·(2·frac(θ/angle + phase/2π) - 1) over the loose gear's angle, on average 0.

    A spring between housing and contact is wound up until static friction is exceeded; the contact slips to where
    kinetic friction holds it. The mean of both frictions belongs to the rig's drag. A slip takes 6 % of the angle; a
    gear that reverses unwinds along the same line. Source: a massless contact on a spring, with static and kinetic
    friction.

    Args:
        amplitude: half of the difference of static and kinetic friction, N·m.
        angle: of the loose gear between two slips, rad.
        phase: of the cycle where the loose gear's angle is 0, rad; it slips at 0 and 2π.

    >>> first, *_ = DragStickSlip(amplitude=0.05, angle=pi / 4).rows(None)
    >>> first.p[0], round(first.p[1], 4)
    (8.0, 0.0317)
    """

    amplitude: float
    angle: float
    phase: float = 0.0

    kind: ClassVar[str] = "drag_stick_slip"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "amplitude": Param("torque", 0.0, 1e4),
        "angle": Param("angle", 1e-3, 100.0, linear=False, refined=Refined(1e-3, 100.0, unit=1e-4)),
        "phase": Param(
            "angle",
            *(-2 * pi, 2 * pi),
            default=0.0,
            linear=False,
            of="loose",
            refined=Refined(-2 * pi, 2 * pi, False, 1.0),
        ),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """The harmonics of the sawtooth."""
        order, rows = 2.0 * pi / self.angle, []
        for n in range(1, HARMONICS + 1):
            mean = pi * n / (HARMONICS + 1)
            size = 2.0 / (pi * n) * sin(mean) / mean * self.amplitude
            rows.append(torque_harmonic(n * order, size, n * self.phase + 0.5 * pi))
        return rows

    def unit_size(self, rig: Rig) -> float:
        """The base drag."""
        return rig.drag_torque
