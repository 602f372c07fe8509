"""Drag that warms away: contact lost, flight and impact as scipy solves them."""

from math import exp

import pytest

from tests.effects.bench import DRAG, MODELS, bench, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("change", [-0.5, 2.0])
def test_first_flight(model, change):
    done = run(model, {"kind": "drag_drift", "relative_change": change, "time_constant": "60 ms"})
    expected = first_flight(lambda t, theta, omega: DRAG * (1 + change * (1 - exp(-t / 0.06))))
    assert off(done, expected) < 1e-7


def test_it_ends_at_the_relative_change():
    case = bench({"kind": "drag_drift", "relative_change": -0.25, "time_constant": "9 s"})
    assert case.rows()[0].p == pytest.approx((-0.25 * DRAG, 9.0))
