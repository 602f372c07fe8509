"""Restitution that scatters from impact to impact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, impact_scatter


@register
@dataclass(frozen=True)
class RestitutionScatter:
    """Restitution e = e0 + standard_deviation·z, z standard normal, clipped to [0, 1]; repeats with ``run.seed``.

    Source: Kadmiri et al. 2012, fig. 7 (wide Gaussian scatter).

    Args:
        standard_deviation: of the coefficient.

    >>> RestitutionScatter(standard_deviation=0.05).rows(None)[0].p
    (0.05,)
    """

    standard_deviation: float

    kind: ClassVar[str] = "restitution_scatter"
    place: ClassVar[Place] = "impact"
    params: ClassVar[dict[str, Param]] = {"standard_deviation": Param("ratio", 0.0, 1.0)}

    def rows(self, rig: Rig) -> list[Row]:
        """One scatter."""
        return [impact_scatter(self.standard_deviation)]

    def unit_size(self, rig: Rig) -> float:
        """The base coefficient, or 0.1 where it is less."""
        return max(rig.restitution, 0.1)
