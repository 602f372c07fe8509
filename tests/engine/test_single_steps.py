"""Single steps of the engine against its own whole runs and against closed forms."""

from itertools import pairwise

import numpy as np
import pytest

from gears3d.engine import Bench, simulate
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
EFFECTS = [
    {"kind": "transmission_error", "order": 5, "amplitude": "10 um"},
    {"kind": "drag_viscous", "coefficient": "0.02 N m s/rad"},
]


@pytest.fixture(scope="module")
def ran():
    scenario = load(FIG5, {"run.duration": "1 s", "run.settle": "0 s", "effect": EFFECTS})
    return scenario, simulate(scenario)


def test_a_whole_run_comes_out_step_by_step(ran):
    scenario, run = ran
    time, loose, omega = (run.signals[name] for name in ("time_s", "theta_loose_rad", "omega_loose_rad_s"))
    hits = run.impacts["time_s"]
    flights = [(a, b) for a, b in pairwise(hits) if b - a > 5e-3]
    contacts = [(side, *span) for side, *span in run.meta["contacts"] if span[1] - span[0] > 5e-3]
    assert len(flights) > 3
    assert len(contacts) > 3
    with Bench(scenario) as bench:
        for a, b in flights:
            rows = np.flatnonzero((time > a + 1e-3) & (time < b - 1e-3))
            rows = rows[run.signals["displacement_m"][rows] > 0.0]
            if np.ptp(np.diff(omega[rows])) > 1e-6:
                continue  # a contact in between
            assert bench.fly(loose[rows[0]], omega[rows[0]], time[rows]) == pytest.approx(loose[rows], abs=1e-10)
        for side, a, b in contacts:
            rows = np.flatnonzero((time > a + 1e-4) & (time < b - 1e-4))
            assert bench.rest(side, time[rows]) == pytest.approx(loose[rows], abs=1e-11)
        for when, side, speed, rebound in zip(
            *(run.impacts[name] for name in ("time_s", "flank", "velocity_m_s", "rebound_m_s")), strict=True
        ):
            hit = bench.strike(when, int(side), abs(speed))
            assert hit.flank == side
            assert hit.velocity_m_s == pytest.approx(speed, abs=2e-9 / abs(speed))
            if rebound:
                assert hit.rebound_m_s / hit.velocity_m_s == pytest.approx(rebound / speed, rel=1e-12)


def test_a_flight_passes_through_flanks_that_are_not_its_business(ran):
    scenario, _ = ran
    times = np.linspace(0.0, 0.05, 11)
    bare = scenario.with_({"effect": []})
    with Bench(bare) as bench:
        path = bench.fly(0.0, 20.0, times)
    fall = 0.5 * scenario.drag.torque / scenario.rig().inertia * times**2
    assert path == pytest.approx(20.0 * times - fall, abs=1e-12)


def test_the_drive_may_stand_anywhere_at_time_zero(ran):
    scenario, _ = ran
    with Bench(scenario) as here, Bench(scenario, 2.0 * np.pi) as there:
        one, other = (bench.rest(0, np.array([0.0, 0.01])) for bench in (here, there))
    assert other - one == pytest.approx(2.0 * np.pi, abs=1e-9)
