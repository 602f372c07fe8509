"""The impact law: which share of the approach speed a flank gives back."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gears3d.effects.rows import Code, Flank, Row
from gears3d.laws.restitution import scatter


class ImpactLaw:
    """Restitution coefficient e = e0 + the contributions of the impact rows, held within 0 and 1.

    Args:
        restitution: base coefficient e0.
        rows: impact rows; others are ignored.
        seed: of the scatter.

    Source: Newton's law of restitution, Rigaud & Perret-Liaudet 2020, eq. (16); speed slope: Kadmiri et al. 2012.

    >>> from gears3d.effects.rows import impact_slope
    >>> round(ImpactLaw(0.7, [impact_slope(-4.0)], seed=0).coefficient(Flank.ACTIVE, 0.05), 3)
    0.5
    """

    def __init__(self, restitution: float, rows: Sequence[Row], seed: int) -> None:
        self._restitution = restitution
        self._rows = [row for row in rows if row.code // 100 == 3]
        self._seed, self._asked = seed, 0

    @property
    def changes(self) -> bool:
        """Whether the coefficient differs from impact to impact."""
        return any(row.code != Code.IMPACT_OFFSET for row in self._rows)

    def coefficient(self, flank: Flank, speed: float) -> float:
        """Return the coefficient for one impact; with scatter rows every call is the next impact's draw.

        Args:
            flank: which is hit.
            speed: of approach [m/s].
        """
        value = self._restitution
        for row in self._rows:
            first = row.p[0]
            if row.code == Code.IMPACT_OFFSET:
                value += first
            elif row.code == Code.IMPACT_SLOPE:
                value += first * abs(speed)
            elif row.code == Code.IMPACT_FLANK:
                value += 0.5 * first if flank == Flank.ACTIVE else -0.5 * first
            elif row.code == Code.IMPACT_SCATTER:
                value += first * scatter(self._seed, self._asked)
        self._asked += 1
        return min(max(value, 0.0), 1.0)


def normal_impulse(inertia: float, lever: float, friction: float, speeds: tuple[float, float]) -> float:
    """Return the impulse along the contact normal that changes the loose gear's speed, friction of the flanks paid.

    Friction turns round with the gear: an impact that stops it and drives it back has a part on either side of rest.

    Args:
        inertia: of the loose gear [kg m²].
        lever: of the normal about its axis, positive on the active flank [m].
        friction: torque against the motion over the flank force [m].
        speeds: of the loose gear before and after [rad/s].

    Returns:
        The impulse, positive [N s].

    Source: J·Δω = P·(lever ∓ friction), the generalised impulse through the contact Jacobian.

    >>> round(normal_impulse(0.07, 0.14, 0.0, (2.0, 3.0)), 12), round(normal_impulse(0.07, 0.14, 0.07, (2.0, 3.0)), 12)
    (0.5, 1.0)
    """
    before, after = speeds
    total = 0.0
    for change, sense in _parts(before, after):
        total += inertia * change / (lever - sense * friction)
    return total


def _parts(before: float, after: float) -> list[tuple[float, float]]:
    """Return the changes of a speed with the sign that it has during each."""
    if before * after < 0.0:
        return [(-before, math.copysign(1.0, before)), (after, math.copysign(1.0, after))]
    return [(after - before, math.copysign(1.0, before + after))]
