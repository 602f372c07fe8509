"""Shear against a turning shaft: contact lost, flight and impact as scipy solves them."""

import pytest

from tests.effects.bench import DRAG, MODELS, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("shaft", [-3.0, 2.0, 8.0])
def test_first_flight(model, shaft):
    done = run(model, {"kind": "drag_differential", "coefficient": "0.02 N m s/rad", "shaft_speed": f"{shaft} rad/s"})
    assert off(done, first_flight(lambda t, theta, omega: DRAG + 0.02 * (omega - shaft))) < 1e-7
