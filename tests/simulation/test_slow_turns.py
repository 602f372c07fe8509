"""Slow turns forth and back: both flanks in turn, in contact all the way, and what cannot be turned is refused."""

import json

import numpy as np
import pytest

from gears3d import cli
from gears3d.errors import InputError
from gears3d.lumped.rig_tests import LEAD, TURNING, slow_turns, there_and_back
from gears3d.recording import read
from gears3d.scenario import load
from gears3d.simulation import record

BASE = "scenarios/base/kadmiri-2012.toml"
SPEED = 0.1
FLANKS = [
    {"kind": "transmission_error", "order": 1, "amplitude": "20 um", "phase": "40 deg"},
    {"kind": "transmission_error", "order": 5, "amplitude": "3 um", "phase": "1 rad", "gear": "loose"},
    {"kind": "transmission_error", "order": 2, "amplitude": "4 um", "phase": "-1 rad", "flank": "active"},
    {"kind": "backlash_variation", "order": 3, "amplitude": "6 um", "phase": "2 rad"},
]


def flanks(drive, loose):
    """Return both flanks by the sums that the effects state [m]."""
    shared = 20e-6 * np.cos(drive + np.radians(40.0)) + 3e-6 * np.cos(5 * loose + 1.0)
    return shared + 4e-6 * np.cos(2 * drive - 1.0), shared + 100e-6 + 6e-6 * np.cos(3 * drive + 2.0)


def test_the_loose_gear_follows_the_active_flank_forth_and_the_reverse_flank_back():
    made = slow_turns(load(BASE, {"effect": FLANKS}), SPEED, 3.0, 50.0).signals
    drive, loose, place = (made[name] for name in ("theta_drive_rad", "theta_loose_rad", "displacement_m"))
    active, reverse = flanks(drive, loose)
    turn = int(np.argmax(drive))
    crossed = np.flatnonzero((np.arange(len(drive)) > turn) & (drive < 2 * np.pi * 3.0))[0]
    assert place[: turn - 50] == pytest.approx(active[: turn - 50], abs=1e-12)
    assert place[crossed:] == pytest.approx(reverse[crossed:], abs=1e-12)
    assert abs(drive[0]) < 1e-14
    assert abs(drive[-1]) < 2 * SPEED / 50.0
    assert drive.max() == pytest.approx(2 * np.pi * (3.0 + LEAD + 5.0 / 16.0 * TURNING), abs=2 * SPEED / 50.0)


def test_the_path_has_no_corner():
    """Each side is extrapolated to the corner by its own polynomial of degree 4: value, speed, acceleration."""
    path = there_and_back(2.0, 10.0, 1.0)
    for corner in (5.0, 6.0):
        sides = []
        for way in (-1.0, 1.0):
            away = way * np.linspace(0.01, 0.2, 9)
            sides.append(np.polyfit(away, path(corner + away), 4)[::-1][:3])
        assert sides[0] == pytest.approx(sides[1], abs=1e-8)


def test_a_gear_that_nothing_holds_is_refused():
    with pytest.raises(InputError, match=r"drag: leaves the loose gear off its (active|reverse) flank for \d+%"):
        slow_turns(load(BASE, {"drag.torque": "0 N m", "effect": FLANKS}), SPEED, 1.0, 50.0)
    for speed, turns, key in ((0.0, 1.0, "--speed"), (-0.1, 1.0, "--speed"), (0.1, 0.0, "--turns")):
        with pytest.raises(InputError, match=f"{key}: is not above 0"):
            slow_turns(load(BASE), speed, turns, 50.0)


def test_encoders_see_slow_turns_at_no_more_than_their_own_rate():
    scenario = load(BASE, {"sensors.drive.noise": "0.001 deg"})
    seen = record(scenario, "transmission-error", speed=SPEED, turns=1.0, seed=3)
    assert 9974 * 2 * 1.05 < len(seen.time) < 9974 * 2 * 1.06
    slow = record(
        scenario.with_({"sensors.sample_rate": "20 Hz"}), "transmission-error", speed=SPEED, turns=1.0, seed=3
    )
    assert slow.meta["encoders"]["sample_rate_Hz"] == 20.0
    assert np.diff(slow.time) == pytest.approx(0.05, abs=1e-9)
    assert list(seen.signals) == ["time_s", "theta_drive_rad", "theta_loose_rad"]
    skewed = scenario.with_({"effect": [{"kind": "encoder_skew", "delay": "10 ms"}]})
    late = record(skewed, "transmission-error", speed=SPEED, turns=1.0, seed=3).signals["theta_loose_rad"]
    apart = seen.signals["theta_loose_rad"] - late
    ratio = 19 / 37
    assert apart[1000:9000].mean() == pytest.approx(0.01 * SPEED * ratio, rel=0.02)
    assert apart[-9000:-1000].mean() == pytest.approx(-0.01 * SPEED * ratio, rel=0.02)


def test_the_command_writes_slow_turns(tmp_path, capsys):
    out = tmp_path / "slow.parquet"
    with pytest.raises(SystemExit) as stop:
        cli.main(
            [
                "synthesize",
                BASE,
                "--out",
                str(out),
                "--test",
                "transmission-error",
                "--speed",
                "2 rpm",
                "--turns",
                "1",
                "--json",
            ]
        )
    assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    assert told["samples"] == len(read(out).time)
    assert read(out).signals["theta_drive_rad"].max() == pytest.approx(2 * np.pi * (1 + LEAD), rel=0.01)
    with pytest.raises(SystemExit) as stop:
        cli.main(["synthesize", BASE, "--out", str(out), "--test", "transmission-error", "--turns", "-1"])
    assert stop.value.code == 3
    assert "--turns: is not above 0" in capsys.readouterr().err
