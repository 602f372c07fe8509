"""A gap that changes over the turn: the flight ends where it is, and rest on the reverse flank follows it."""

from math import cos, sin

import numpy as np
import pytest

from tests.effects.bench import BACKLASH, DRAG, MODELS, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("order", "amplitude"), [(1, 30e-6), (3, -30e-6), (90, 2e-6)])
def test_first_flight(model, order, amplitude):
    effect = {"kind": "backlash_variation", "order": order, "amplitude": f"{amplitude} m", "phase": "0.4 rad"}
    gap = lambda theta: BACKLASH + amplitude * cos(order * theta + 0.4)  # noqa: E731
    slope = lambda theta: -order * amplitude * sin(order * theta + 0.4)  # noqa: E731
    assert off(run(model, effect), first_flight(lambda t, theta, omega: DRAG, gap=gap, slope=slope)) < 2e-7


@pytest.mark.parametrize("model", MODELS)
def test_the_reverse_flank_follows_it_and_the_active_one_stays(model):
    effect = {"kind": "backlash_variation", "order": 2, "amplitude": "40 um"}
    done = run(model, effect, run__duration="0.34 s", impact__restitution=0.0)
    s, theta = done.signals["displacement_m"], done.signals["theta_drive_rad"]
    wall = BACKLASH + 40e-6 * np.cos(2 * theta)
    assert s.min() == pytest.approx(0.0, abs=1e-10)
    assert (s - wall).max() == pytest.approx(0.0, abs=1e-10)
    rests = np.abs(s - wall) < 1e-10
    assert np.ptp(wall[rests]) > 5e-6  # it rested there while the wall moved
