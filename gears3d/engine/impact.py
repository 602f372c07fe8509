"""The impact law: the coefficient of restitution of an impact, and its impulse."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gears3d.effects.rows import Code, Flank, Row
from gears3d.engine.compile import inner
from gears3d.laws.contact import scatter

_OFFSET = int(Code.IMPACT_OFFSET)
_SLOPE = int(Code.IMPACT_SLOPE)
_FLANK = int(Code.IMPACT_FLANK)
_SCATTER = int(Code.IMPACT_SCATTER)
_ACTIVE = int(Flank.ACTIVE)


@inner
def coefficient(restitution: float, table: np.ndarray, flank: int, speed: float, draw: float) -> float:
    """Return the coefficient of restitution of one impact at an approach speed [m/s].

    ``restitution`` is the base coefficient e0, ``table`` (n, 2) has code and number of the impact rows, ``draw`` is the
    standard normal number of this impact, for its scatter.
    """
    value = restitution
    for i in range(table.shape[0]):
        code, first = table[i, 0], table[i, 1]
        if code == _OFFSET:
            value += first
        elif code == _SLOPE:
            value += first * abs(speed)
        elif code == _FLANK:
            value += 0.5 * first if flank == _ACTIVE else -0.5 * first
        elif code == _SCATTER:
            value += first * draw
    return min(max(value, 0.0), 1.0)


class ImpactLaw:
    """Restitution coefficient e = e0 + the contributions of the impact rows, clipped to [0, 1].

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
        self.restitution = restitution
        self.table = np.array([(row.code, row.p[0]) for row in rows if row.code // 100 == 3]).reshape(-1, 2)
        self._seed, self._asked = seed, 0

    @property
    def changes(self) -> bool:
        """Whether the coefficient differs from impact to impact."""
        return bool((self.table[:, 0] != _OFFSET).any())

    def draws(self, used: int, count: int) -> np.ndarray:
        """Return the standard normal numbers of the next impacts (count,), zeros without scatter.

        ``used`` is the number of impacts since the last call.
        """
        self._asked += used
        if (self.table[:, 0] != _SCATTER).all():
            return np.zeros(count)
        return np.array([scatter(self._seed, index) for index in range(self._asked, self._asked + count)])

    def coefficient(self, flank: Flank, speed: float) -> float:
        """Return the coefficient for one impact at an approach speed [m/s]; a call draws the next scatter."""
        draw = float(self.draws(0, 1)[0])
        self._asked += 1
        return float(coefficient(self.restitution, self.table, flank, speed, draw))


@inner
def normal_impulse(inertia: float, lever: float, friction: float, speeds: tuple[float, float]) -> float:
    """Return the impulse along the contact normal for a change of the loose gear's speed, with flank friction [N s].

    Friction changes sign with the direction: an impact that stops the gear and drives it back has a part on either side
    of rest. ``inertia`` is in kg m²; ``lever`` [m] is that of the normal about the gear's axis, positive on the active
    flank; ``friction`` [m] is the torque against the motion over the flank force; ``speeds`` [rad/s] are before and
    after.

    Source: J·Δω = P·(lever ∓ friction), the generalised impulse through the contact Jacobian.
    """
    before, after = speeds
    if before * after < 0.0:
        to_rest = -before / (lever - math.copysign(friction, before))
        return inertia * (to_rest + after / (lever - math.copysign(friction, after)))
    return inertia * (after - before) / (lever - math.copysign(friction, before + after))
