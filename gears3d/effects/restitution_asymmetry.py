"""Restitution that differs between the flanks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, impact_flank


@register
@dataclass(frozen=True)
class RestitutionAsymmetry:
    """Restitution e = e0 + asymmetry/2 on the active and e0 - asymmetry/2 on the reverse flank, clipped to [0, 1].

    Source: the mean impact speeds 22.3 and 19.9 mm/s of Rigaud & Perret-Liaudet 2020, which differ.

    Args:
        asymmetry: coefficient on the active less that on the reverse flank.

    >>> RestitutionAsymmetry(asymmetry=0.1).rows(None)[0].p
    (0.1,)
    """

    asymmetry: float

    kind: ClassVar[str] = "restitution_asymmetry"
    place: ClassVar[Place] = "impact"
    params: ClassVar[dict[str, Param]] = {"asymmetry": Param("ratio", -2.0, 2.0)}

    def rows(self, rig: Rig) -> list[Row]:
        """One difference."""
        return [impact_flank(self.asymmetry)]

    def unit_size(self, rig: Rig) -> float:
        """The base coefficient, or 0.1 where it is less."""
        return max(rig.restitution, 0.1)
