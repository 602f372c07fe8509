"""A motion picked up amid a run goes on as the run did, whatever depends on time and on angles."""

from pathlib import Path

import numpy as np
import pytest

from gears3d.lumped import rigid
from gears3d.lumped.pickup import Start, pick_up
from gears3d.scenario import load

ROOT = Path(__file__).resolve().parents[2]
EFFECTS = {
    "none": [],
    "waves and drift": [
        {"kind": "transmission_error", "order": 3, "amplitude": "30 um", "phase": "40 deg"},
        {"kind": "eccentricity", "gear": "loose", "offset": "20 um", "phase": "70 deg"},
        {"kind": "drag_drift", "relative_change": 0.5, "time_constant": "2 s"},
        {"kind": "drag_position", "amplitude": "0.05 N m", "order": 2, "phase": "30 deg"},
    ],
    "tooth": [{"kind": "pitch_error", "gear": "drive", "tooth": 37, "offset": "60 um"}],
    "yielding": [{"kind": "tooth_compliance", "stiffness": "0.2 MN/m", "damping": "10 N s/m"}],
}


def exact(bench, time):
    """The drive's angle in closed form."""
    angle = bench.motion.mean * time
    for one in bench.motion.harmonics:
        turn = 2.0 * np.pi * one.frequency
        angle = angle - one.amplitude / turn * (np.cos(turn * time + one.phase) - np.cos(one.phase))
    return angle


@pytest.mark.parametrize("name", EFFECTS)
def test_goes_on_as_the_run_did(name):
    bench = load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "2 s"})
    bench = bench.with_([("effect[+]", table) for table in EFFECTS[name]])
    whole = rigid.simulate(bench)
    place = whole.signals["displacement_m"]
    after = np.searchsorted(whole.time, 1.0)
    amid = after + int(np.argmin(np.abs(place[after : after + 8000] - 125e-6)))
    row = {key: float(values[amid]) for key, values in whole.signals.items()}
    time = row["time_s"] + np.linspace(0.0, 0.7, 2000)
    start = Start(row["time_s"], row["theta_drive_rad"], row["theta_loose_rad"], place[amid], row["velocity_m_s"])
    part = pick_up(bench, start, time, exact(bench, time), bench.run.output_rate)
    same = slice(amid, amid + len(part.time))
    assert part.time == pytest.approx(whole.time[same])
    assert np.abs(part.signals["displacement_m"] - place[same]).max() < 1e-9
    for key in ("theta_drive_rad", "theta_loose_rad"):
        assert part.signals[key] == pytest.approx(whole.signals[key][same], abs=1e-8)
    hits = whole.impacts["time_s"]
    inside = (hits > time[0]) & (hits < time[-1])
    assert len(part.impacts["time_s"]) == inside.sum() > 4
    assert part.impacts["tooth_drive"].tolist() == whole.impacts["tooth_drive"][inside].tolist()


@pytest.mark.parametrize("flank", [0, 1])
def test_rides_on_the_flank_that_holds(flank):
    bench = load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml")
    time = 3.0 + np.linspace(0.0, 0.3, 40)
    drive = 5.0 + (-1.0 if flank else 1.0) * 2.0 * (time - 3.0)
    made = pick_up(bench, Start(3.0, 5.0, 5.0, 0.0, 0.0), time, drive, 1000.0, riding=flank)
    assert made.signals["displacement_m"] == pytest.approx(np.full(301, flank * 250e-6), abs=1e-12)
    assert not len(made.impacts["time_s"])


def test_a_place_in_a_flank_is_moved_off_it():
    bench = load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml")
    time = np.linspace(0.0, 0.3, 40)
    made = pick_up(bench, Start(0.0, 0.0, 0.0, -5e-6, 0.0), time, 3.0 * time, 1000.0)
    assert 0.0 <= made.signals["displacement_m"].min() < 1e-12
