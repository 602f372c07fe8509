"""The coast-down of a shaft under a drag law, for any law, as quadratures over its speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Intervals of the speed between start and end.
NODES = 600
# Nodes from 1 to 0, that crowd at the end.
_CROWDED = (1.0 - np.linspace(0.0, 1.0, NODES + 1)) ** 2
_GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


class Law(NamedTuple):
    """Deceleration coulomb + viscous·ω + coefficient·ω^exponent while the shaft turns forwards.

    Args:
        coulomb: [rad/s²].
        viscous: [1/s].
        coefficient: [rad/s² at 1 rad/s].
        exponent: of the speed.
        more: coefficient and exponent of each further power.
        table: speeds [rad/s], rising, and further decelerations there [rad/s²], straight in between.
        push: acceleration by a known torque that spins the shaft up [rad/s²]; no part of the drag.
    """

    coulomb: float = 0.0
    viscous: float = 0.0
    coefficient: float = 0.0
    exponent: float = 2.0
    more: tuple[tuple[float, float], ...] = ()
    table: tuple[np.ndarray, np.ndarray] | None = None
    push: float = 0.0

    def deceleration(self, speed: np.ndarray) -> np.ndarray:
        """Return the deceleration [rad/s²] at speeds [rad/s], (n,).

        Source: Kadmiri et al. 2012, eqs (5)-(7), divided by the inertia.
        """
        slowing = self.coulomb + self.viscous * speed
        for coefficient, exponent in ((self.coefficient, self.exponent), *self.more):
            if coefficient:
                with np.errstate(divide="ignore", over="ignore"):
                    slowing = slowing + coefficient * np.abs(speed) ** exponent
        return slowing if self.table is None else slowing + np.interp(speed, *self.table)


def angles(law: Law, angle: float, speed: float, since: np.ndarray, slowest: float = 0.0) -> np.ndarray | None:
    """Return the angle of a shaft that coasts down freely.

    ``angle``: at the start [rad]; ``speed``: at the start, positive [rad/s]; ``since``: time since the start [s], (n,);
    ``slowest``: speed down to which the law must hold [rad/s]; 0: to standstill. Returns angles [rad], (n,), constant
    after standstill; ``None`` where the law does not slow the shaft down.

    >>> float(angles(Law(coulomb=2.0), 0.0, 4.0, np.array([1.0, 3.0]))[0].round(9))
    3.0
    """
    found = coasting(law, speed, since, slowest)
    return None if found is None else angle + found[0]


def coasting(
    law: Law, speed: float, since: np.ndarray, slowest: float = 0.0, only: str = ""
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return angle and speed of a shaft that coasts down freely, the angle from 0.

    Time and angle are integrals over the speed, dt = dω/a(ω) and dθ = ω·dω/a(ω), by Gauss quadrature between nodes that
    crowd at the end; between the nodes the angle is the quintic that has their speeds and decelerations, the speed the
    cubic. Means over a long record resolve the angle to a thousandth of a count, which the cubic of the speeds alone
    would not reach.

    ``speed``: at the start, positive [rad/s]; ``since``: time since the start [s], (n,); ``slowest``: speed down to
    which the law must hold [rad/s]; 0: to standstill.
    """
    if not speed > slowest:
        return None
    return _between(law, slowest + (speed - slowest) * _CROWDED, since, only)


def spinning_up(law: Law, speed: float, since: np.ndarray, only: str = "") -> tuple[np.ndarray, np.ndarray] | None:
    """Return angle and speed of a shaft that a known torque spins up against a drag law, the angle from 0.

    The same quadratures as of a coast-down, from the first speed up to the one that the torque would give without drag,
    or to the terminal speed where the drag equals the torque.

    ``speed``: at the start [rad/s]; ``since``: time since the start [s], (n,).

    >>> spinning_up(Law(viscous=1.0, push=2.0), 0.0, np.array([1.0]))[1].round(6).tolist()  # 2 (1 - 1/e)
    [1.264241]
    """
    if speed < 0.0 or not len(since) or not law.push > 0.0:
        return None
    top = speed + 1.5 * law.push * float(since[-1]) + 1e-300  # a drag with a driving part may add to the torque
    grid = np.linspace(speed, top, NODES + 1)
    ahead = law.push - law.deceleration(grid)
    if not (np.all(np.isfinite(ahead[1:])) and ahead[1 if np.isinf(ahead[0]) else 0] > 0.0):
        return None
    if np.any(stuck := ahead <= 0.0):
        low, high = grid[int(np.argmax(stuck)) - 1], grid[int(np.argmax(stuck))]
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if law.push > float(law.deceleration(np.array(middle))) else (low, middle)
        top = low
    if not top > speed:
        return None
    return _between(law, top + (speed - top) * _CROWDED, since, only)


def _between(law: Law, nodes: np.ndarray, since: np.ndarray, only: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Return angle and speed on the way from the first to the last node."""
    width = -np.diff(nodes)
    inner = 0.5 * (nodes[:-1] + nodes[1:])[:, None] + 0.5 * width[:, None] * _GAUSS
    slowing = law.deceleration(inner) - law.push
    at_nodes = law.deceleration(nodes) - law.push
    sense = np.sign(width[0])
    if not (np.all(sense * slowing > 0.0) and np.all(np.isfinite(slowing)) and np.all(sense * at_nodes[:-1] > 0.0)):
        return None
    time = np.concatenate([[0.0], np.cumsum(width * (_WEIGHTS / slowing).sum(axis=1))])
    way = np.concatenate([[0.0], np.cumsum(width * (_WEIGHTS * inner / slowing).sum(axis=1))])
    k = np.clip(np.searchsorted(time, since, "right") - 1, 0, NODES - 1)
    span = time[k + 1] - time[k]
    u = np.clip((since - time[k]) / np.maximum(span, 1e-300), 0.0, 1.0)
    a = np.where(np.isfinite(at_nodes), at_nodes, 0.0)
    fell = nodes[k] + (nodes[k + 1] - nodes[k]) * u**2 * (3.0 - 2.0 * u)
    fell -= span * u * (1.0 - u) * (a[k] * (1.0 - u) - a[k + 1] * u)
    if only == "speed":
        return fell, fell
    turned = way[k] + (way[k + 1] - way[k]) * u**3 * (10.0 - u * (15.0 - 6.0 * u))
    turned += span * nodes[k] * u * (1.0 - u**2 * (6.0 - u * (8.0 - 3.0 * u)))
    turned -= span * nodes[k + 1] * u**3 * (4.0 - u * (7.0 - 3.0 * u))
    turned -= 0.5 * span**2 * a[k] * u**2 * (1.0 - u) ** 3
    turned -= 0.5 * span**2 * a[k + 1] * u**3 * (1.0 - u) ** 2
    return turned, fell
