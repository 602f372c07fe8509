"""Viscous drag: contact lost, flight and impact as scipy solves them."""

import pytest

from tests.effects.bench import DRAG, MODELS, bench, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
def test_first_flight(model):
    done = run(model, {"kind": "drag_viscous", "coefficient": "0.02 N m s/rad"})
    assert off(done, first_flight(lambda t, theta, omega: DRAG + 0.02 * omega)) < 1e-7


def test_unit_size_doubles_the_drag_at_the_mean_speed():
    rig = bench({"kind": "drag_viscous", "coefficient": "1 N m s/rad"}).rig()
    effect = bench({"kind": "drag_viscous", "coefficient": "1 N m s/rad"}).effects[0]
    assert effect.unit_size(rig) * rig.mean_speed_loose == pytest.approx(rig.drag_torque)
