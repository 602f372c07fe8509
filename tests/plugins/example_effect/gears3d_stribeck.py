"""A seal whose friction falls with the speed and rises again: a law that none of gears3d's own forms has."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, tanh
from typing import ClassVar

import numba
import numpy as np

from gears3d.effects import Param, Place, Rig, Row, Variable, register, torque_table
from gears3d.effects.tabulate import tabulate


@numba.njit
def stribeck(speed, static, falls_at, viscous):
    """Torque [N m] over speeds [rad/s], (n,): smooth at rest, falling at first, then viscous."""
    torque = np.zeros_like(speed)
    for k in range(len(speed)):
        w = speed[k]
        torque[k] = static * tanh(10.0 * w / falls_at) * exp(-((w / falls_at) ** 2)) + viscous * w
    return torque


@register
@dataclass(frozen=True)
class StribeckSeal:
    """Friction of a seal on the loose gear's shaft that falls with the speed before it rises.

    Args:
        static: largest torque at low speeds, N·m.
        falls_at: speed at which it has fallen, rad/s.
        viscous: rise with the speed, N·m·s/rad.
    """

    static: float
    falls_at: float
    viscous: float = 0.0

    kind: ClassVar[str] = "stribeck_seal"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "static": Param("torque", 0.0, 1e3),
        "falls_at": Param("speed", 1e-3, 1e4, linear=False),
        "viscous": Param("rotational_damping", 0.0, 1e3, 0.0),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One table over the speed, to a millionth of the static torque."""
        widest = max(10.0 * rig.mean_speed_loose, 10.0 * self.falls_at)

        def law(speed):
            return stribeck(np.asarray(speed, dtype=float), self.static, self.falls_at, self.viscous)

        return [torque_table(Variable.SPEED, tabulate(law, -widest, widest, 1e-6 * self.static))]

    def unit_size(self, rig: Rig) -> float:
        """The static torque that equals the base drag."""
        return rig.drag_torque
