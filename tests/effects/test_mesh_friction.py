"""Friction of the flanks: rigid ones keep their motion and pay in impulses; those that yield feel it in the stroke."""

import numpy as np
import pytest

from tests.effects.bench import MODELS, run

FRICTION = {"kind": "mesh_friction", "coefficient": 0.1}


@pytest.mark.parametrize("model", MODELS)
def test_impulses_pay_the_friction_and_the_motion_stays(model):
    plain, rough = (run(model, *effects, run__duration="0.3 s") for effects in ((), (FRICTION,)))
    assert np.abs(rough.signals["displacement_m"] - plain.signals["displacement_m"]).max() < 1e-12
    assert rough.meta["contacts"] == pytest.approx(np.array(plain.meta["contacts"]), abs=1e-9)
    ratio = rough.impacts["impulse_N_s"] / plain.impacts["impulse_N_s"]
    expected = np.where(plain.impacts["flank"] == 0, 1 / 0.9, 1 / 1.1)
    assert set(plain.impacts["flank"]) == {0, 1}
    rounded = 1e-12 / np.abs(plain.impacts["velocity_m_s"])  # speeds of either run, the slowest 0.3 mm/s
    assert np.all(np.abs(ratio / expected - 1.0) < 1e-9 + rounded)


@pytest.mark.parametrize("model", MODELS)
def test_it_turns_round_with_the_gear(model):
    """Driven backwards, the active flank pushes against the motion and friction helps it."""
    plain, rough = (
        run(model, *effects, run__duration="0.3 s", motion__mean="-60 rpm", start__state="reverse")
        for effects in ((), (FRICTION,))
    )
    ratio = rough.impacts["impulse_N_s"] / plain.impacts["impulse_N_s"]
    assert ratio == pytest.approx(np.where(plain.impacts["flank"] == 0, 1 / 1.1, 1 / 0.9), rel=1e-8)


@pytest.mark.parametrize("model", MODELS)
def test_on_flanks_that_yield_it_shares_in_the_stroke(model):
    """A spring hits the active flank: force and friction stand against each other, the mass feels k·(1 - μ)."""
    soft = {"kind": "tooth_compliance", "stiffness": "1e11 N/m"}
    changes = {"start__state": "free", "run__duration": "8 ms"}
    plain, rough = (run(model, soft, *more, **changes).impacts for more in ((), (FRICTION,)))
    assert rough["velocity_m_s"][0] == pytest.approx(plain["velocity_m_s"][0], rel=1e-9)
    assert -rough["rebound_m_s"][0] / rough["velocity_m_s"][0] == pytest.approx(1.0, abs=5e-3)
    assert rough["impulse_N_s"][0] / plain["impulse_N_s"][0] == pytest.approx(1 / 0.9, rel=1e-3)
