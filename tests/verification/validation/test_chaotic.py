"""Rates and speeds of chaotic motion: the checks on them can fail, and do where the motion is another one."""

from __future__ import annotations

import numpy as np

from gears3d.simulation import simulate
from gears3d.verification.validation.agreement import PHASES, WIDTH, bright, ratio, summary


def twins(restitution: float, shift: float) -> np.ndarray:
    """Return rate and mean speed of the twin's runs, (2, runs), each started a little later in the swing."""
    scenarios = [bright(phase + shift).with_({"impact.restitution": restitution}) for phase in PHASES]
    return np.array([summary(simulate(one, "rigid")) for one in scenarios]).T


def test_another_restitution_is_told_and_the_same_one_is_not() -> None:
    reference = twins(0.95, 0.0)
    for own, other, same in zip(twins(0.94, 7.0), reference, twins(0.95, 7.0), strict=True):
        low, high = ratio(own, other)
        assert not low <= 1.0 <= high
        low, high = ratio(same, other)
        assert low <= 1.0 <= high
        assert (high - low) / 2 < WIDTH
