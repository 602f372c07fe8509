"""A body that the loose gear carries on a torsional spring: a synchroniser hub, a clutch disc, a flexible web."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, torque_carried


@register
@dataclass(frozen=True)
class CarriedInertia:
    """Inertia on a torsional spring with damping and play; impacts act on the loose gear alone.

    The spring's torque on the loose gear is C = k·δ + c·δ̇, with the body turned ahead by δ. With play it is
    k·(|δ| - play/2) + c·|δ|˙ beyond half of the play, never pulls back across it, and is 0 within. At the start the
    body turns with the gear, without twist, in mid-play. Source: two masses on a spring; the natural frequency of the
    pair in free flight is √(k·(1/J + 1/Jc)).

    Args:
        inertia: of the body, Jc, kg·m².
        stiffness: k, N·m/rad.
        damping: c, N·m·s/rad.
        play: full width of the spring's dead band, rad.

    >>> CarriedInertia(inertia=0.01, stiffness=100.0).rows(None)[0].p
    (0.01, 100.0, 0.0, 0.0)
    """

    inertia: float
    stiffness: float
    damping: float = 0.0
    play: float = 0.0

    kind: ClassVar[str] = "carried_inertia"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "inertia": Param("inertia", 1e-12, 1e6, linear=False),
        "stiffness": Param("rotational_stiffness", 1e-6, 1e12, linear=False, refined=Refined(1e-6, 1e12)),
        "damping": Param("rotational_damping", 0.0, 1e6, default=0.0, linear=False, refined=Refined(0.0, 1e6, False)),
        "play": Param("angle", 0.0, pi, default=0.0, linear=False, refined=Refined(0.0, pi, False)),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One body."""
        return [torque_carried(self.inertia, self.stiffness, self.damping, self.play)]

    def unit_size(self, rig: Rig) -> float:
        """The inertia of the loose gear."""
        return rig.inertia
