"""A torque that depends on the loose gear's angle: unbalance, a rubbing pin, cogging of its encoder."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, torque_harmonic


@register
@dataclass(frozen=True)
class DragPosition:
    """Torque C = amplitude·cos(order·θ + phase) over the loose gear's angle, for both directions of motion.

    Source: order 1 is the unbalance m·g·r·cos(θ + phase) of a gear on a level shaft.

    Args:
        amplitude: N·m.
        order: cycles per revolution of the loose gear.
        phase: rad.

    >>> DragPosition(amplitude=0.05, order=2).rows(None)[0].p
    (2.0, 0.05, 0.0)
    """

    amplitude: float
    order: int = 1
    phase: float = 0.0

    kind: ClassVar[str] = "drag_position"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "amplitude": Param("torque", -1e4, 1e4),
        "order": Param("count", 1, 1000, default=1, linear=False),
        "phase": Param("angle", -2 * pi, 2 * pi, default=0.0, linear=False, of="loose"),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One harmonic of the angle."""
        return [torque_harmonic(float(self.order), self.amplitude, self.phase)]

    def unit_size(self, rig: Rig) -> float:
        """The base drag."""
        return rig.drag_torque
