"""A restitution coefficient other than the one the scenario states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, impact_offset


@register
@dataclass(frozen=True)
class RestitutionOffset:
    """Restitution e = e0 + offset, clipped to [0, 1]. Source: Newton's law, Rigaud & Perret-Liaudet 2020, eq. (16).

    Args:
        offset: added to the coefficient.

    >>> RestitutionOffset(offset=-0.1).rows(None)[0].p
    (-0.1,)
    """

    offset: float

    kind: ClassVar[str] = "restitution_offset"
    place: ClassVar[Place] = "impact"
    params: ClassVar[dict[str, Param]] = {"offset": Param("ratio", -1.0, 1.0)}

    def rows(self, rig: Rig) -> list[Row]:
        """One offset."""
        return [impact_offset(self.offset)]

    def unit_size(self, rig: Rig) -> float:
        """The base coefficient, or 0.1 where it is less."""
        return max(rig.restitution, 0.1)
