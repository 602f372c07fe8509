"""How the body of a gear gives way under a tooth."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.stiffness.material import STEEL, Material

COEFFICIENTS = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)
"""A to F of L*, M*, P* and Q*."""
ROOT_ANGLE = (0.01, 0.12)
"""Half the angle that a tooth spans at the root circle, as far as the coefficients were fitted [rad]."""
BODY_RATIO = (1.4, 7.0)
"""Root radius over bore radius, as far as they were fitted."""


def foundation(
    arm: ArrayLike,
    angle: ArrayLike,
    thickness: float,
    root_angle: float,
    body_ratio: float = BODY_RATIO[0],
    material: Material = STEEL,
) -> NDArray[np.float64]:
    """Return how far a tooth moves with its body, cos²α/E·(L*·(u/S)² + M*·u/S + P*·(1 + Q*·tan²α)).

    The body is an elastic ring that stands still at the bore, so the twist between bore and root is part of it: P*
    grows with the square of the ratio of the radii. Outside the range of the fit its nearest end is taken.

    Args:
        arm: u, from the root circle to where the force crosses the middle of the tooth [m], (m,).
        angle: α, by which the force points to the axis [rad], (m,).
        thickness: S of the tooth at the root [m].
        root_angle: half the angle that the tooth spans there [rad].
        body_ratio: root radius over bore radius.
        material: of the gear.

    Returns:
        Compliance for a unit of width, in the direction of the force [m²/N], (m,).

    Source: Sainsot, Velex & Duverger 2004; the lubricated dual-clutch transmission, eq. (9).

    >>> far, near = foundation([4e-3, 2e-3], 0.35, 6e-3, 0.05, 2.0)
    >>> bool(far > near)
    True
    """
    theta, ratio = float(np.clip(root_angle, *ROOT_ANGLE)), float(np.clip(body_ratio, *BODY_RATIO))
    terms = np.array([theta**-2, ratio**2, ratio / theta, 1.0 / theta, ratio, 1.0])
    second, first, constant, slant = COEFFICIENTS @ terms
    lever = np.asarray(arm, float) / thickness
    shape = second * lever**2 + first * lever + constant * (1.0 + slant * np.tan(angle) ** 2)
    return np.cos(angle) ** 2 * shape / material.young
