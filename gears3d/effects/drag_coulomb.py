"""Coulomb drag (dry friction) on the loose gear, in addition to the base drag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, torque_constant


@register
@dataclass(frozen=True)
class DragCoulomb:
    """Constant torque against the motion, C = torque·sgn Ω, with stiction at rest; it adds to the base drag.

    Closed form: :func:`gears3d.laws.drag.coulomb`; evaluated in ``engine.torques`` and ``lumped.torques``.
    A negative torque is a deviation: base drag that was stated too large. All dry drag together must not be negative.
    Source: Rigaud & Perret-Liaudet 2020, coast-down of the loose gear at constant deceleration.

    Args:
        torque: N·m.

    >>> DragCoulomb(torque=0.05).rows(None)[0].p
    (0.05,)
    """

    torque: float

    kind: ClassVar[str] = "drag_coulomb"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {"torque": Param("torque", -1e4, 1e4)}

    def rows(self, rig: Rig) -> list[Row]:
        """One constant torque."""
        return [torque_constant(self.torque)]

    def unit_size(self, rig: Rig) -> float:
        """The base drag."""
        return rig.drag_torque
