"""One more sine in the imposed motion of the drive."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, motion_harmonic
from gears3d.errors import Fault, InputError


@register
@dataclass(frozen=True)
class DriveMotion:
    """Speed amplitude·sin(2π·frequency·t + phase) added to the drive's motion.

    The amplitude is a speed, an angle or an angular acceleration, as in ``[motion].harmonics``; an angle or an
    acceleration becomes the amplitude of the speed's sine. Source: Rigaud & Perret-Liaudet 2020, eqs (1) and (5).

    Args:
        amplitude: rad/s, rad or rad/s², as ``amplitude_family`` says.
        frequency: Hz; 0 when ``order`` is given.
        order: cycles per mean revolution of the drive; 0 when ``frequency`` is given.
        phase: rad.
        amplitude_family: ``"speed"``, ``"angle"`` or ``"acceleration"``.

    Raises:
        InputError: both of frequency and order, or none.

    >>> DriveMotion(amplitude=0.5, frequency=6.0).rows(None)[0].p
    (0.5, 6.0, 0.0)
    """

    amplitude: float
    frequency: float = 0.0
    order: float = 0.0
    phase: float = 0.0
    amplitude_family: str = "speed"

    kind: ClassVar[str] = "drive_motion"
    place: ClassVar[Place] = "motion"
    params: ClassVar[dict[str, Param]] = {
        "amplitude": Param("speed", -1e6, 1e6, also=("angle", "acceleration")),
        "frequency": Param("frequency", 0.0, 1e6, default=0.0, linear=False, refined=Refined(1e-2, 1e5)),
        "order": Param("ratio", 0.0, 1e4, default=0.0, linear=False, refined=Refined(1e-3, 1e4)),
        "phase": Param("angle", -2 * pi, 2 * pi, default=0.0, linear=False),
    }

    def __post_init__(self) -> None:
        if self.frequency > 0.0 and self.order > 0.0:
            raise InputError(Fault("order", "stands in addition to frequency", "keep one of the two"))
        if not (self.frequency > 0.0 or self.order > 0.0):
            raise InputError(Fault("frequency", "is missing", 'e.g. frequency = "3 Hz", or order = 2'))

    def rows(self, rig: Rig | None) -> list[Row]:
        """One sine of the drive's speed; an order without a mean speed of the drive is an InputError."""
        frequency = self._frequency(rig)
        return [motion_harmonic(self.amplitude * self._as_speed(frequency), frequency, self.phase)]

    def unit_size(self, rig: Rig) -> float:
        """The amplitude that takes the whole drag as inertia, Λ = 1."""
        frequency = self._frequency(rig)
        ratio = rig.base_radius_drive / rig.base_radius_loose
        speed = rig.drag_torque / (rig.inertia * ratio * 2 * pi * frequency)
        return speed / self._as_speed(frequency)

    def _frequency(self, rig: Rig | None) -> float:
        if self.order == 0.0:
            return self.frequency
        if rig is None or rig.mean_speed == 0.0:
            raise InputError(Fault("order", "needs a mean speed, and motion.mean is 0 rpm", 'e.g. frequency = "3 Hz"'))
        return self.order * abs(rig.mean_speed) / (2 * pi)

    def _as_speed(self, frequency: float) -> float:
        """Return the factor from the amplitude to that of the speed [rad/s per its own unit]."""
        turn = 2 * pi * frequency
        return {"speed": 1.0, "angle": turn, "acceleration": 1 / turn}[self.amplitude_family]
