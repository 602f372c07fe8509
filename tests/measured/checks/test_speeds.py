"""Speeds in other units than rad/s, and what decoders saw, are told by the gate."""

import numpy as np
import pytest

from gears3d.measured.checks import admit, correct, examine
from gears3d.measured.readers import Channels
from gears3d.scenario import load
from tests.measured.checks.clean import RIGAUD, rattling

RPM = 30.0 / np.pi


def told(found, *kinds):
    return [one for one in found if one.kind in kinds]


def with_speeds(**factors):
    scenario, columns = rattling(noise=0.001)
    for gear, factor in factors.items():
        rate = np.gradient(columns[f"theta_{gear}_rad"], columns["time_s"])
        noise = np.random.default_rng(3).normal(0.0, 0.02, len(rate))
        smooth = np.convolve(rate, np.full(101, 1 / 101), "same") + noise
        smooth[:60], smooth[-60:] = smooth[60], smooth[-60]
        columns[f"omega_{gear}_rad_s"] = factor * smooth
    return scenario, Channels(columns)


@pytest.mark.parametrize("factor", [RPM, -RPM, 180 / np.pi, 0.5 / np.pi, -1.0])
def test_a_speed_in_another_unit_is_told_by_the_angle(factor):
    scenario, channels = with_speeds(drive=1.0, loose=factor)
    (one,) = told(examine(channels, scenario), "speed-unit")
    assert (one.channel, one.fatal, one.correctable) == ("omega_loose_rad_s", False, True)
    assert one.size == pytest.approx(factor)
    mended = correct(channels, [one], ["speed-unit"])
    assert not told(examine(mended, scenario), "speed-unit")


def test_a_speed_of_another_shaft_is_told_but_not_corrected():
    scenario, channels = with_speeds(drive=0.4)
    (one,) = told(examine(channels, scenario), "speed-unit")
    assert not one.correctable
    assert one.size == pytest.approx(0.4, rel=0.02)


def test_speeds_in_radians_are_silent():
    scenario, channels = with_speeds(drive=1.0, loose=1.0)
    assert not told(examine(channels, scenario), "speed-unit")


@pytest.mark.parametrize(
    ("factor", "kinds"), [(RPM, ["speed-unit"]), (180 / np.pi, ["speed-unit"]), (1.0, []), (1.3, [])]
)
def test_a_run_down_of_speeds_is_held_against_the_mean_speed(factor, kinds):
    time = np.linspace(0.0, 2.0, 5001)
    scenario = load(RIGAUD, {"sensors.sample_rate": "2500 Hz"})
    speed = scenario.motion.mean * (1.0 - 0.3 * time)
    rows = Channels({"time_s": time, "omega_rad_s": factor * speed})
    found = examine(rows, scenario, needs=(("omega_rad_s",),), stated_motion=True)
    assert [one.kind for one in found] == kinds
    assert all(one.fatal and one.size == pytest.approx(factor) for one in found)


def test_what_decoders_saw_is_told(tmp_path):
    time = np.arange(0.0, 4.0, 1e-4)
    angle = 5.0 * time
    level = np.floor(angle / (2 * np.pi) * 400).astype(int)
    level[20_000:] += 2  # two edges between two samples: either way round
    a, b = ((np.isin(level % 4, on)).astype(float) for on in ((1, 2), (2, 3)))
    table = np.column_stack([time, a, b, angle])
    path = tmp_path / "run.csv"
    np.savetxt(path, table, delimiter=",", header="time_s,A,B,theta_drive_rad", comments="")
    chart = tmp_path / "record.toml"
    chart.write_text('format = 1\n[loose]\ndecode = { kind = "quadrature", a = "A", b = "B", lines = 100 }\n')
    found = told(admit(path, None, chart).findings, "illegal-transitions")
    assert len(found) == 1
    assert found[0].size >= 1
    assert found[0].remedy
