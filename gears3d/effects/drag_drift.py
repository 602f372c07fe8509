"""Base drag that changes while a rig warms up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, torque_relax
from gears3d.errors import Fault, InputError


@register
@dataclass(frozen=True)
class DragDrift:
    """Base drag times 1 + relative_change·(1 - exp(-t/time_constant)).

    Source: relaxation of first order, as the temperature of one body in a bath.

    Args:
        relative_change: of the base drag in the end; -0.2 for a decrease by 20 %.
        time_constant: s.

    >>> from gears3d.effects.base import Rig
    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.3, 3.1, 90, 90)
    >>> DragDrift(relative_change=-0.5, time_constant=60.0).rows(rig)[0].p
    (-0.11, 60.0)
    """

    relative_change: float
    time_constant: float

    kind: ClassVar[str] = "drag_drift"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "relative_change": Param("ratio", -1.0, 100.0),
        "time_constant": Param(
            "time", 1e-6, 1e9, linear=False, tried=(0.03, 0.1, 0.3, 1.0, 3.0), refined=Refined(0.1, 1e4)
        ),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One torque that grows to its final value; a base drag of 0 is an InputError."""
        if rig.drag_torque == 0.0:
            text = "is a share of drag.torque, which is 0 N m"
            raise InputError(Fault("relative_change", text, 'give drag.torque, e.g. torque = "0.22 N m"'))
        return [torque_relax(self.relative_change * rig.drag_torque, self.time_constant)]

    def unit_size(self, rig: Rig) -> float:
        """A change by the whole base drag."""
        return 1.0
