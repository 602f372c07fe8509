"""Dry drag more or less: contact lost, flight and impact as scipy solves them."""

import pytest

from tests.effects.bench import DRAG, MODELS, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("torque", [0.05, -0.05])
def test_first_flight(model, torque):
    done = run(model, {"kind": "drag_coulomb", "torque": f"{torque} N m"})
    assert off(done, first_flight(lambda t, theta, omega: DRAG + torque)) < 1e-7


@pytest.mark.parametrize("model", MODELS)
def test_it_is_the_base_drag_by_another_name(model):
    more = run(model, {"kind": "drag_coulomb", "torque": "-0.02 N m"})
    assert off(run(model, drag__torque="0.2 N m"), first_flight(lambda t, theta, omega: 0.2)) < 1e-7
    assert off(more, first_flight(lambda t, theta, omega: 0.2)) < 1e-7
