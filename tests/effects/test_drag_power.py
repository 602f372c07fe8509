"""Drag as a power of the speed: contact lost, flight and impact as scipy solves them."""

import pytest

from tests.effects.bench import DRAG, MODELS, bench, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("exponent", [0.59, 1.5, 2.0])
def test_first_flight(model, exponent):
    done = run(model, {"kind": "drag_power", "coefficient": "0.02 N m", "exponent": exponent})
    assert off(done, first_flight(lambda t, theta, omega: DRAG + 0.02 * omega**exponent)) < 1e-7


def test_unit_size_doubles_the_drag_at_the_mean_speed():
    case = bench({"kind": "drag_power", "coefficient": "1 N m", "exponent": 1.5})
    size = case.effects[0].unit_size(case.rig())
    assert size * case.rig().mean_speed_loose ** 1.5 == pytest.approx(DRAG)
