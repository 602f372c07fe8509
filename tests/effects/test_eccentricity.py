"""Eccentric teeth: each flank and the gap wander as the shifted circles say, in the engine to all orders."""

from math import cos, radians, sin

import numpy as np
import pytest

from gears3d.gears import Eccentricity, quasi_static
from tests.effects.bench import BACKLASH, MODELS, bench, run

OFFSET, PHASE = 40e-6, radians(35)
SECOND = OFFSET**2 / 0.1
"""What the first order leaves out: the offset squared over the length of the path of contact [m]."""


def resting(model, gear, start, sign=1.0, phase=PHASE):
    """Angles of both gears and displacement while the gear rests on a flank, over a turn at constant speed."""
    effect = {"kind": "eccentricity", "gear": gear, "offset": f"{sign * OFFSET} m", "phase": f"{phase} rad"}
    mean = "60 rpm" if start == "active" else "-60 rpm"  # dry drag presses onto the flank that drives
    changes = {"motion__harmonics": [], "motion__mean": mean, "start__state": start, "drag__torque": "5 N m"}
    done = run(model, effect, run__duration="1 s", run__output_rate="200 Hz", **changes)
    assert len(done.impacts["time_s"]) == 0
    theta = {which: done.signals[f"theta_{which}_rad"] for which in ("drive", "loose")}
    return theta, done.signals["displacement_m"]


def first_order(gear, flank, theta, sign=1.0, phase=PHASE):
    """Displacement at which a flank touches, to first order: the offset along the flank's normal."""
    angle = bench().pair().working_pressure_angle
    x, lean = theta + phase, angle if (gear == "drive") == (flank == "active") else -angle
    moved = sign * OFFSET * np.sin(x + lean) * (1.0 if gear == "drive" else -1.0)
    return moved if flank == "active" else BACKLASH + moved


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("flank", ["active", "reverse"])
@pytest.mark.parametrize(("gear", "sign"), [("drive", 1.0), ("loose", -1.0)])
def test_flanks_wander_as_the_circles_do(model, gear, flank, sign):
    theta, s = resting(model, gear, flank, sign)
    expected = first_order(gear, flank, theta[gear], sign)
    assert np.ptp(expected) > 1.5 * OFFSET
    assert np.abs(s - expected).max() < SECOND


@pytest.mark.parametrize("flank", ["active", "reverse"])
@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_the_engine_follows_the_surfaces_to_all_orders(gear, flank):
    theta, s = resting("bullet", gear, flank)
    pair = bench().pair().with_mounting(Eccentricity(gear, OFFSET, PHASE))
    exact = quasi_static(pair, theta["drive"])
    touching = exact.phi_active if flank == "active" else exact.phi_reverse + BACKLASH
    assert np.abs(s - touching).max() < 1e-11
    assert np.abs(s - first_order(gear, flank, theta[gear])).max() > 1e-10  # the second order is there to be seen


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_both_flanks_make_the_backlash(gear):
    """b changes by -2·e·sin αw·cos(θ + phase), with either gear: narrow where the offset points at the mate."""
    theta = np.linspace(0, 6, 7)
    angle = bench().pair().working_pressure_angle
    width = first_order(gear, "reverse", theta) - first_order(gear, "active", theta)
    expected = [BACKLASH - 2 * OFFSET * sin(angle) * cos(x + PHASE) for x in theta]
    assert width == pytest.approx(expected, abs=1e-18)


@pytest.mark.parametrize("gear", ["drive", "loose"])
@pytest.mark.parametrize("sign", [1, -1])
def test_impacts_move_as_the_twins_do(gear, sign):
    effect = {"kind": "eccentricity", "gear": gear, "offset": f"{sign * 20e-6} m", "phase": "40 deg"}
    engine, twin = (run(model, effect, run__duration="0.3 s").impacts for model in ("bullet", "rigid"))
    plain = run("rigid", run__duration="0.3 s").impacts
    moved = np.abs(twin["time_s"] - plain["time_s"]).max()
    assert np.abs(engine["time_s"] - twin["time_s"]).max() < 1e-3 * moved
    assert engine["velocity_m_s"] == pytest.approx(twin["velocity_m_s"], rel=1e-4)
