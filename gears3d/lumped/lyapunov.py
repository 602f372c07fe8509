"""The largest Lyapunov exponent of a run, from a copy that is disturbed again every period.

Source: Benettin et al. 1980, Meccanica 15, part 2.
"""

from __future__ import annotations

from math import hypot, inf, log, pi

import numpy as np

from gears3d.lumped import layout as at
from gears3d.lumped.kernel import advance
from gears3d.lumped.model import Model

# Size of a disturbance in tolerances of the integrator, times the backlash: far above the error of its steps.
DISTURBANCE = 1e3
# A disturbance that shrinks by more than this within a period is rounding noise: contact has erased it. Such a period
# counts as this much and the copy is disturbed again, as all differences of two runs disturb them repeatedly: a motion
# that diverges for many periods and sticks once is chaotic. Only where every period erases the disturbance is the
# exponent minus infinity.
WIPED = 1e-6


class Shadow:
    """A copy of the motion with a small disturbance, which is integrated over the same periods.

    Args:
        m: the packed model.
        period: between two renormalisations [s].
        duration: of the run [s]; its first 10 %, and at least two periods if there are more than four, are excluded.
    """

    def __init__(self, m: Model, period: float, duration: float) -> None:
        self._model, self._numbers = m, m.flat()
        self._size = DISTURBANCE * m.tolerance * m.backlash
        self._omega = 2 * pi / period
        self._from = 0.0 if duration < 4.5 * period else max(2 * period, 0.1 * duration)
        self._buffers = at.buffers(len(m.torques) + len(m.flanks), 4096, 1024, 0, inf)
        self._direction = (1.0, 0.0)
        self._growth = 0.0
        self._lasts = False
        self._time = 0.0

    def follow(self, before: np.ndarray, after: np.ndarray, total: int, end: float) -> None:
        """Advance the copy over one period that ends at ``end`` [s], between the run's states ``before`` and ``after``.

        The scatter continues after ``total`` impacts.
        """
        start = before[at.TIME]
        if start < self._from * (1 - 1e-12) or end <= start:
            return
        copy = self._disturbed(before)
        own = np.zeros(at.COUNTERS, dtype=np.int64)
        own[at.TOTAL] = total
        while advance(self._numbers, copy, own, self._buffers, end) in (at.IMPACTS_FULL, at.CONTACTS_FULL):
            own[at.N_IMPACTS] = own[at.N_CONTACTS] = 0
        apart = (copy[at.DISPLACEMENT] - after[at.DISPLACEMENT], self._speed(copy) - self._speed(after))
        distance = hypot(*apart)
        self._time += end - start
        if not distance > WIPED * self._size:
            self._growth += log(WIPED)
            self._direction = (1.0, 0.0)
            return
        self._lasts = True
        self._growth += log(distance / self._size)
        self._direction = (apart[0] / distance, apart[1] / distance)

    def exponent(self) -> float:
        """Return the exponent [1/s]; NaN when no period was followed."""
        if self._time == 0.0:
            return float("nan")
        return self._growth / self._time if self._lasts else -inf

    def _speed(self, state: np.ndarray) -> float:
        return float(state[at.SPEED]) * self._model.radius_loose / self._omega

    def _disturbed(self, state: np.ndarray) -> np.ndarray:
        copy = state.copy()
        shift, kick = (part * self._size for part in self._direction)
        mode = int(state[at.MODE])
        if at.STUCK <= mode < at.PRESSED:
            flank = mode - at.STUCK
            copy[at.MODE], copy[at.DEPARTED] = at.FREE, flank
            copy[at.SIGN] = np.sign(state[at.SPEED]) or 1.0
            kick, shift = 0.0, self._size if flank == 0 else -self._size
        elif mode == at.FREE and min(state[at.GAPS] + shift, state[at.GAPS + 1] - shift) <= 0.0:
            kick, shift = -kick, -shift
        copy[at.DISPLACEMENT] += shift
        copy[at.GAPS] += shift
        copy[at.GAPS + 1] -= shift
        copy[at.ANGLE] += shift / self._model.radius_loose
        copy[at.SPEED] += kick * self._omega / self._model.radius_loose
        copy[at.RATES] += kick * self._omega
        copy[at.RATES + 1] -= kick * self._omega
        copy[at.LIFT], copy[at.GUESS] = -1.0, inf
        return copy
