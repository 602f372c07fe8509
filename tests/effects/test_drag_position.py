"""Drag over the angle: contact lost, flight and impact as scipy solves them."""

from math import cos

import pytest

from tests.effects.bench import DRAG, MODELS, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("order", "amplitude"), [(1, 0.1), (1, -0.1), (7, 0.05), (90, 0.02)])
def test_first_flight(model, order, amplitude):
    done = run(model, {"kind": "drag_position", "order": order, "amplitude": f"{amplitude} N m", "phase": "0.4 rad"})
    expected = first_flight(lambda t, theta, omega: DRAG + amplitude * cos(order * theta + 0.4))
    assert off(done, expected) < 1e-7
