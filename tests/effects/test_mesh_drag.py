"""Drag in contact alone: contact is lost later, the flight is that of the base drag."""

import pytest

from tests.effects.bench import DRAG, MODELS, bench, first_flight, off, run


@pytest.mark.parametrize("model", MODELS)
def test_first_flight(model):
    done = run(model, {"kind": "mesh_drag", "coefficient": "0.02 N m s/rad"})
    expected = first_flight(lambda t, theta, omega: DRAG + 0.02 * omega, lambda t, theta, omega: DRAG)
    assert off(done, expected) < 1e-7
    assert expected[1] < first_flight(lambda t, theta, omega: DRAG + 0.02 * omega)[1] - 1e-5


def test_size_from_the_published_damping_ratios():
    """Ottewill et al. 2010: c = δ·I·Ω; of δcontact = 4.2 and δ = 2.3 the difference is the mesh drag."""
    inertia, turns = 0.01, 1.0
    case = bench({"kind": "mesh_drag", "coefficient": f"{(4.2 - 2.3) * inertia * turns} N m s/rad"})
    assert case.rows()[0].p == pytest.approx((0.019, 0.0))
