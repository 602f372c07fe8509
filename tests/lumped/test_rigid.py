"""The rigid model on scenarios: the columns of its recording, what it says about itself, how it ends early."""

import subprocess
import sys
from math import inf, pi

import numpy as np
import pytest

from gears3d.errors import EngineError
from gears3d.lumped import layout, rigid
from gears3d.lumped import run as running
from gears3d.scenario import load
from tests.lumped.rig import RPM, bench, simulate

FIGURE = "scenarios/rigaud-2020/fig5-20rpm.toml"


@pytest.fixture(scope="module")
def scenario():
    return load(FIGURE, {"impact.restitution": 0.5, "run.duration": "2 s", "run.output_rate": "2 kHz"})


@pytest.fixture(scope="module")
def recording(scenario):
    return rigid.simulate(scenario)


def test_signals_are_consistent(scenario, recording):
    s = recording.signals
    rb = scenario.rig().base_radius_drive
    assert s["time_s"].tolist() == pytest.approx(np.arange(4001) / 2000)
    assert np.abs(s["omega_drive_rad_s"] - 30 * RPM - 20 * RPM * np.sin(6 * pi * s["time_s"])).max() < 1e-13
    swing = 20 * RPM / (6 * pi) * (1 - np.cos(6 * pi * s["time_s"]))
    assert np.abs(s["theta_drive_rad"] - 30 * RPM * s["time_s"] - swing).max() < 1e-13
    assert np.abs(rb * (s["theta_loose_rad"] - s["theta_drive_rad"]) - s["displacement_m"]).max() < 1e-14
    assert np.abs(rb * (s["omega_loose_rad_s"] - s["omega_drive_rad_s"]) - s["velocity_m_s"]).max() < 1e-13
    assert s["displacement_m"].min() >= 0.0
    assert s["displacement_m"].max() <= 250e-6 * (1 + 1e-12)


def test_impacts_are_consistent(scenario, recording):
    hit, rig = recording.impacts, scenario.rig()
    flank = hit["flank"]
    assert hit["flank"].dtype == np.int8
    assert (np.sign(hit["velocity_m_s"]) == np.where(flank == 0, -1, 1)).all()
    mass = rig.inertia / rig.base_radius_loose**2
    assert np.allclose(hit["impulse_N_s"], mass * (hit["rebound_m_s"] - hit["velocity_m_s"]), rtol=1e-9)
    assert (np.sign(hit["impulse_N_s"]) == np.where(flank == 0, 1, -1)).all()
    assert np.allclose(hit["phase_rad"], np.mod(6 * pi * hit["time_s"], 2 * pi))
    angle = np.interp(hit["time_s"], recording.time, recording.signals["theta_drive_rad"])
    assert (np.abs((hit["tooth_drive"] - 1 - angle * 90 / (2 * pi) + 45) % 90 - 45) <= 0.51).all()
    apart = (hit["tooth_drive"] - hit["tooth_loose"] + 45) % 90 - 45
    assert np.abs(apart).max() <= 1  # both round, the gap lies between them
    assert np.mean(apart == 0) > 0.9
    crossing = np.flatnonzero(np.diff(flank))
    assert np.allclose(hit["flight_height_m"][crossing + 1], 250e-6, rtol=1e-9)


def test_it_says_what_it_is(recording):
    meta = recording.meta
    assert meta["model"] == "rigid"
    assert meta["lyapunov_1_s"] == -inf
    assert meta["counters"]["impacts"] == meta["impacts"] == len(recording.impacts["time_s"])
    assert meta["counters"]["contacts"] == 12
    assert meta["interrupted"] is False
    assert meta["reached_s"] == 2.0


def test_phase_of_the_first_harmonic(scenario):
    turned = load(FIGURE, {"motion.harmonics[0].phase": "90 deg", "run.duration": "2 s"})
    hit = rigid.simulate(turned).impacts
    assert np.allclose(hit["phase_rad"], np.mod(6 * pi * hit["time_s"] + pi / 2, 2 * pi))


def test_progress_and_interruption(scenario):
    seen = []
    rigid.simulate(scenario, seen.append)
    assert seen == pytest.approx(np.arange(1, 7) / 3)

    def stop(done):
        if done > 0.9:
            raise KeyboardInterrupt

    part = rigid.simulate(scenario, stop)
    assert part.meta["interrupted"] is True
    assert part.meta["reached_s"] == pytest.approx(1.0)
    assert part.time[-1] == pytest.approx(1.0)
    assert len(part.impacts["time_s"]) > 10


def test_a_run_does_not_depend_on_the_room_for_its_tables(monkeypatch):
    whole = simulate(5.0, e=0.5, spacing=1e-3)
    roomy = running.at.buffers
    monkeypatch.setattr(running.at, "buffers", lambda rows, i, c, s, d: roomy(rows, 7, 2, s, d))
    pieces = simulate(5.0, e=0.5, spacing=1e-3)
    assert np.array_equal(whole.impacts, pieces.impacts)
    assert np.array_equal(whole.contacts, pieces.contacts)
    assert np.array_equal(whole.samples, pieces.samples)


def test_lyapunov_exponents():
    forgets = simulate(10.0, e=0.5, lyapunov=True)
    assert forgets.lyapunov == -inf
    # a bounce on a steady floor: the state is shifted along the orbit for ever
    short, long = (
        simulate(duration, "free", amplitude=0.0, e=1.0, stick_velocity=0.0, lyapunov=True).lyapunov
        for duration in (50.0, 500.0)
    )
    assert abs(long) < min(0.05, abs(short) / 3)
    # hard rebounds across the gap under strong excitation: neighbours part
    wild = {"amplitude": 60 * RPM, "frequency": 10.0, "e": 0.9, "backlash": 1e-3, "mean": 90 * RPM}
    chaos = simulate(60.0, "free", lyapunov=True, **wild)
    longer = simulate(120.0, "free", lyapunov=True, **wild)
    assert chaos.lyapunov > 1.0
    assert longer.lyapunov == pytest.approx(chaos.lyapunov, rel=0.2)
    assert np.isnan(simulate(1.0).lyapunov)


@pytest.mark.parametrize(
    ("status", "message"),
    [
        (layout.STANDSTILL, "time stands still; give a larger impact.stick_velocity"),
        (layout.BROKEN, "no longer finite"),
    ],
)
def test_a_run_that_cannot_go_on_says_where_and_why(monkeypatch, status, message):
    begin = running.advance

    def advance(m, state, count, out, end):
        if end == 0.0:
            return begin(m, state, count, out, end)
        count[layout.TOTAL], state[layout.TIME] = 7, 0.25
        return status

    monkeypatch.setattr(running, "advance", advance)
    with pytest.raises(EngineError, match=rf"stopped at 0.25 s after 7 impacts: .*{message}"):
        simulate(1.0)


def test_a_motion_that_is_not_finite_ends_the_run():
    model = bench()._replace(inertia=float("nan"))
    with pytest.raises(EngineError, match=r"no longer finite; check the effects' sizes"):
        running.run(model, 1.0, start="free")


def test_importing_the_room_compiles_nothing():
    code = "import sys, gears3d.lumped; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
