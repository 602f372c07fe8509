"""Stick-slip: contact lost, flight and impact as scipy solves them with straight lines, and its work."""

from math import pi

import numpy as np
import pytest

from gears3d.effects import catalogue
from tests.effects.bench import DRAG, MODELS, first_flight, found, run

SLIP = 1 / 17
"""Part of the angle that a slip takes."""


def sawtooth(theta, angle, phase):
    """Straight lines: half of the slip at the beginning of a cycle, half at its end."""
    wound = (theta / angle + phase / (2 * pi)) % 1.0
    corners = [0.0, 0.5 * SLIP, 1.0 - 0.5 * SLIP, 1.0]
    return np.interp(wound, corners, [0.0, SLIP - 1.0, 1.0 - SLIP, 0.0])


def stick_slip(amplitude, angle, phase):
    values = {"amplitude": f"{amplitude} N m", "angle": f"{angle} rad", "phase": f"{phase} rad"}
    return {"kind": "drag_stick_slip", **values}


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("amplitude", "angle", "phase"), [(0.05, 0.5, 0.3), (0.1, 0.07, -2.0), (0.03, 7.0, 1.0)])
def test_first_flight(model, amplitude, angle, phase):
    done = found(run(model, stick_slip(amplitude, angle, phase)))
    plain = first_flight(lambda t, theta, omega: DRAG)
    ideal = first_flight(lambda t, theta, omega: DRAG + amplitude * sawtooth(theta, angle, phase))
    moved = np.abs(np.subtract(ideal, plain))
    assert np.all(moved > 1e-5)
    assert np.all(np.abs(np.subtract(done, ideal)) < 0.005 * moved.max())


def test_it_is_the_sawtooth_and_does_no_work_over_a_cycle():
    angle, phase = 0.4, 1.2
    rows = catalogue()["drag_stick_slip"](amplitude=0.2, angle=angle, phase=phase).rows(None)
    theta = np.linspace(-3.0, 3.0, 15001)[:-1]
    torque = sum(p * np.cos(order * theta + at) for order, p, at in (row.p for row in rows))
    wrong = np.abs(torque - 0.2 * sawtooth(theta, angle, phase)) / 0.2
    wound = theta / angle + phase / (2 * pi)
    assert wrong.max() < 0.1
    assert wrong[np.abs(wound - np.round(wound)) > SLIP].max() < 0.01
    assert abs(np.mean(torque)) < 1e-12
