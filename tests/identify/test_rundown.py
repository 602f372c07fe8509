"""Drag from run-downs: the law is found, its numbers are unbiased, and the intervals cover."""

import json

import numpy as np
import pytest
from scipy.stats import binomtest

from gears3d import cli
from gears3d.errors import InputError
from gears3d.identify import identify_rundown, make_track
from gears3d.identify.motion import Law, angles
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.signals import count_of
from tests.identify import shafts

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"


def measured(kind, encoder, seed):
    """Return a track and its true parameters."""
    counts, rate = shafts.ENCODERS[encoder]
    random = np.random.default_rng(seed)
    if kind == "coulomb":
        truth = {"coulomb": random.uniform(0.1, 0.8)}
        time, angle = shafts.coulomb(truth["coulomb"], random.uniform(2.0, 12.0), rate)
    elif kind == "coulomb+viscous":
        truth = {"coulomb": random.uniform(0.1, 0.5), "viscous": random.uniform(0.01, 0.04)}
        time, angle = shafts.viscous(truth["coulomb"], truth["viscous"], random.uniform(20.0, 80.0), rate)
    else:
        truth = {"coulomb": 0.3, "coefficient": 0.02, "exponent": random.uniform(1.4, 2.2)}
        time, angle = shafts.churning(0.3, 0.02, truth["exponent"], 60.0, rate)
    return make_track(time, shafts.counted(angle, counts, seed)), truth


def test_the_run_down_by_quadrature_is_that_of_the_equation_of_motion():
    time, angle = shafts.churning(0.2, 0.003, 1.7, 90.0, 1e3)
    law = Law(0.2 / shafts.INERTIA, 0.0, 0.003 / shafts.INERTIA, 1.7)
    assert angles(law, 0.0, 90.0, time) == pytest.approx(angle, abs=1e-7)


def decayed(coulomb, viscous, power):
    """Return angles [rad] from 50 rad/s on to a fiftieth of it, in closed form, and when [s]."""
    start = 50.0
    if power:
        time = np.linspace(0.0, (50.0 / start - 1.0 / start) / power, 100_001)
        return time, np.log1p(start * power * time) / power
    rest = coulomb / viscous
    time = np.linspace(0.0, np.log((start + rest) / (0.02 * start + rest)) / viscous, 100_001)
    return time, (start + rest) * -np.expm1(-viscous * time) / viscous - rest * time


@pytest.mark.parametrize("law", [(0.0, 0.13, 0.0), (2.0, 0.13, 0.0), (0.0, 0.0, 0.01)])
def test_the_angle_is_known_better_than_means_over_a_long_record_know_it(law):
    """Counts of 4 urad leave 2e-9 rad in the mean of 300 000 samples; a long decay is to be known better."""
    coulomb, viscous, power = law
    time, angle = decayed(*law)
    found = angles(Law(coulomb, viscous, power, 2.0), 0.0, 50.0, time)
    assert np.abs(found - angle).max() < 2e-10


@pytest.mark.parametrize("encoder", shafts.ENCODERS)
@pytest.mark.parametrize("kind", ["coulomb", "coulomb+viscous", "coulomb+power"])
def test_the_law_is_found_and_its_numbers_are_right(kind, encoder):
    track, truth = measured(kind, encoder, seed=11)
    found = identify_rundown([track], shafts.INERTIA)
    assert found.law == kind
    for name, value in truth.items():
        parameter = found.parameters[name]
        error = (parameter.high - parameter.low) / 3.92
        assert abs(parameter.value - value) < 4.5 * error
        assert error < 0.003 * value


@pytest.mark.slow
@pytest.mark.parametrize("encoder", shafts.ENCODERS)
@pytest.mark.parametrize("kind", ["coulomb", "coulomb+viscous"])
def test_intervals_cover(kind, encoder, record_property):
    campaigns, inside, off = 100, 0, []
    for seed in range(1000, 1000 + campaigns):
        track, truth = measured(kind, encoder, seed)
        found = identify_rundown([track], shafts.INERTIA)
        parameters = [found.parameters.get(name) for name in truth]
        if None in parameters:
            continue
        inside += all(p.low <= truth[name] <= p.high for name, p in zip(truth, parameters, strict=True))
        first = parameters[0]
        off.append((first.value - truth["coulomb"]) / ((first.high - first.low) / 3.92))
    interval = binomtest(inside, len(off)).proportion_ci(0.95)
    record_property("coverage", f"{inside}/{len(off)}, 95 % {interval.low:.3f} to {interval.high:.3f}")
    assert len(off) >= 0.95 * campaigns
    assert inside / len(off) >= 0.88  # all numbers of the law at once
    assert 0.55 < np.std(off) < 1.3  # neither too sure nor idly wide: 1 when the interval says what it means
    assert abs(np.mean(off)) < 4.0 / np.sqrt(len(off))


def test_a_fine_encoder_that_never_counts_by_one_is_no_faulty_one(tmp_path):
    """Half a minute at 50 kHz: dozens of counts a sample at first, a few at last."""
    time, angle = shafts.viscous(0.05, 0.004, 60.0, 50e3)
    signals = {"time_s": time, "theta_drive_rad": 0.0 * time, "theta_loose_rad": shafts.counted(angle, 1_600_000, 1)}
    assert count_of(signals["theta_loose_rad"]) == pytest.approx(2 * np.pi / 1_600_000, rel=1e-6)
    Recording(signals).write(tmp_path / "rundown.parquet")
    found = identify_rundown([tmp_path / "rundown.parquet"], shafts.INERTIA)
    assert found.law == "coulomb+viscous"
    for name, truth in (("coulomb", 0.05), ("viscous", 0.004)):
        parameter = found.parameters[name]
        assert abs(parameter.value - truth) < 4.5 * (parameter.high - parameter.low) / 3.92


def test_several_run_downs_share_the_law():
    tracks = []
    for seed, speed in enumerate((15.0, 40.0, 70.0)):
        time, angle = shafts.viscous(0.25, 0.02, speed, 1e3)
        tracks.append(make_track(time, shafts.counted(angle, 40_000, seed)))
    alone, together = (identify_rundown(chosen, shafts.INERTIA) for chosen in (tracks[:1], tracks))
    assert together.parameters["viscous"].low <= 0.02 <= together.parameters["viscous"].high
    widths = [p.high - p.low for p in (alone.parameters["coulomb"], together.parameters["coulomb"])]
    assert widths[1] < 0.5 * widths[0]


def test_an_uncertain_inertia_widens_every_torque_alike():
    track, _ = measured("coulomb", "400 000 ppr", seed=2)
    found = identify_rundown([track], shafts.INERTIA, 0.02 * shafts.INERTIA).parameters["coulomb"]
    assert (found.high - found.low) / 3.92 / found.value == pytest.approx(0.02, rel=1e-3)


def test_the_snippet_goes_into_a_scenario():
    track, truth = measured("coulomb+power", "400 000 ppr", seed=3)
    found = identify_rundown([track], shafts.INERTIA)
    base = 'format = 1\nextends = "scenarios/base/rigaud-2020.toml"\n'
    scenario = load(base + found.snippet)
    assert scenario.drag.torque == pytest.approx(truth["coulomb"], rel=1e-2)
    assert scenario.effects[0].kind == "drag_power"


def test_a_row_without_a_reading_is_excluded(tmp_path):
    rows = [f"{time:.4f},{3.0 * time - time**2:.6f}" for time in np.linspace(0.0, 1.0, 101)]
    rows[50] = "0.5000,"
    (tmp_path / "hole.csv").write_text("\n".join(["time_s,theta_loose_rad", *rows]) + "\n")
    found = identify_rundown([tmp_path / "hole.csv"], 1.0)
    assert found.parameters["coulomb"].value == pytest.approx(2.0, rel=1e-4)
    assert any("not-finite" in str(one) or "1 row" in str(one) for one in found.goodness["findings"])


def test_what_cannot_be_used_is_told(tmp_path):
    t = np.linspace(0.0, 1.0, 2001)
    with pytest.raises(InputError, match="does not run down"):
        make_track(t, 3.0 * t)
    swaying = make_track(t, 3.0 * t - t**2 - 0.05 * np.cos(20.0 * t))
    assert "does not explain the record" in identify_rundown([swaying], 1.0).warnings[0]
    with pytest.raises(InputError, match="changes 12 times only"):
        make_track(t, shafts.counted(3.0 * t - 1.5 * t**2, 50, 1))
    rows = [f"{time:.4f},{3.0 * time - time**2:.6f}" for time in np.linspace(0.0, 1.0, 101)]
    back = [*rows[:50], rows[48], *rows[50:]]
    for head, lines, told in (
        ("time_s,theta_loose_rad", back, r"time_s: time stamps.*some decrease.*row 50"),
        ("time_s,speed", rows, "theta_loose_rad: column .* is missing"),
        ("time_s,theta_loose_rad", rows[:2], "time_s: has 2 rows"),
    ):
        text = "\n".join([head, *lines]) + "\n"
        file = tmp_path / "bad.csv"
        file.write_text(text)
        with pytest.raises(InputError, match=told):
            identify_rundown([file], 1.0)
    with pytest.raises(InputError, match="is not there"):
        identify_rundown([tmp_path / "nowhere.csv"], 1.0)


def test_the_command_prints_the_contract_and_draws(tmp_path, capsys):
    time, angle = shafts.coulomb(0.22, 3.0, 1e4)
    seen = shafts.counted(angle, 40_000, 1)
    file, picture = tmp_path / "r.parquet", tmp_path / "drag.png"
    Recording({"time_s": time, "theta_drive_rad": 0.0 * time, "theta_loose_rad": seen}).write(file)
    arguments = ["identify", "coastdown", str(file), "--inertia", "0.0695 kg m^2", "--json", "--out", str(picture)]
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    assert told["law"] == "coulomb"
    assert told["parameters"]["coulomb"]["unit"] == "N m"
    low, high = told["parameters"]["coulomb"]["ci95"]
    assert low <= 0.22 <= high
    assert picture.stat().st_size > 10_000
    with pytest.raises(SystemExit) as stop:
        cli.main(["identify", "coastdown", str(file), "--inertia", "3 kg"])
    assert stop.value.code == 3
    assert "--inertia: '3 kg' is a mass, not" in capsys.readouterr().err
