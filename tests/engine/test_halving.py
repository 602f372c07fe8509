"""The error that half the step tells is the error there is, and it falls with the fourth power of the step."""

import numpy as np
import pytest

from gears3d.engine import Bench, simulate
from gears3d.engine.run import halved
from gears3d.errors import UsageError
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import simulate as any_model

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
WAVY = [
    {"kind": "drag_position", "amplitude": "0.6 N m", "order": 36, "phase": "20 deg"},
    {"kind": "drag_viscous", "coefficient": "0.05 N m s/rad"},
]


def rattle(**changes):
    given = {"run.duration": "0.4 s", "run.settle": "0 s", "effect": WAVY, "impact.restitution": 0.5}
    return load(FIG5, {**given, "run.output_rate": "2 kHz", **changes})


def off(made, exact):
    return float(np.abs(made.impacts["velocity_m_s"] - exact.impacts["velocity_m_s"]).max())


def test_the_estimate_is_the_error_and_falls_with_the_fourth_power():
    """Below the duration of the flights: a shorter one is a single step, whatever the longest is."""
    exact = simulate(rattle(), step=6.25e-5)
    coarse, fine = simulate(rattle(), step=5e-4, error_estimate=True), simulate(rattle(), step=2.5e-4)
    assert len(exact.impacts["time_s"]) > 10
    assert np.log2(off(coarse, exact) / off(fine, exact)) == pytest.approx(4.0, abs=0.3)
    told = coarse.meta["error_estimate"]
    assert told["impact_velocity_m_s"] == pytest.approx(off(coarse, exact), rel=0.1)
    place = np.abs(coarse.signals["displacement_m"] - exact.signals["displacement_m"]).max()
    assert told["displacement_m"] == pytest.approx(place, rel=0.1)
    assert told["impacts"] == len(exact.impacts["time_s"])
    assert (told["order"], told["parted"]) == (4, False)
    assert (told["step_s"], told["half_step_s"]) == (5e-4, 2.5e-4)


def test_a_flight_alone_is_of_fourth_order():
    """Torque over angle has no closed form; a run with much shorter steps stands for it."""
    times = np.array([0.0, 0.02])

    def lands(step):
        scenario = rattle(**{"motion.harmonics": []})
        with Bench(scenario) as bench:
            bench._settings.longest_step = step
            return bench.fly(0.0, 3.0, times)[-1]

    exact = lands(1e-5)
    errors = [abs(lands(0.02 / n) - exact) for n in (10, 20, 40)]
    ratios = np.array(errors[:-1]) / errors[1:]
    assert ratios == pytest.approx([16.0, 16.0], rel=0.1)


def test_constant_torques_leave_no_error_to_estimate():
    told = simulate(rattle(effect=[]), error_estimate=True).meta["error_estimate"]
    assert told["displacement_m"] < 1e-14
    assert told["impact_velocity_m_s"] < 1e-11


def test_motions_that_part_are_compared_until_then():
    time = np.linspace(0.0, 1.0, 101)
    place = np.zeros(101)
    apart = np.where(time >= 0.5, 1e-4, 1e-8)

    def record(place, flanks, step):
        hits = {"time_s": [0.1, 0.2, 0.8], "flank": flanks, "velocity_m_s": [-0.1, -0.2, -0.3]}
        signals = {"time_s": time, "theta_drive_rad": time, "theta_loose_rad": time, "displacement_m": place}
        return Recording(signals, hits, {"longest_step_s": step})

    told = halved(record(place, [0, 1, 0], 1e-3), record(apart, [0, 1, 1], 5e-4), 250e-6, 1)
    assert told["parted"]
    assert told["until_s"] == pytest.approx(0.49)
    assert told["displacement_m"] == pytest.approx(2e-8)
    assert told["impacts"] == 2
    assert halved(record(place, [0, 0, 0], 1e-3), record(apart, [0, 1, 1], 5e-4), 250e-6, 1)["impacts"] == 1


def test_only_the_engine_has_a_step_to_halve():
    with pytest.raises(UsageError, match="no step to halve"):
        any_model(rattle(), "rigid", error_estimate=True)
