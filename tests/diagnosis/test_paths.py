"""Models that are started from measured states: what refutes a cause, and what records a rig itself would give."""

import numpy as np
import pytest

from gears3d.diagnosis.evidence import Paths
from gears3d.diagnosis.preprocessing import preprocess
from gears3d.diagnosis.residual_patterns import simulated
from gears3d.diagnosis.validity import PathErrors, path_errors
from gears3d.diagnosis.verdict import Named
from gears3d.effects import catalogue
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan
from tests.diagnosis.blind import cases, play


def named(kind, size, unit, **more):
    (name,) = more
    effect = catalogue()[kind](**more)
    written = {"kind": kind, name: f"{size!r} {unit}".strip() if unit else size}
    return Named(kind, effect.place, {}, "", 0.0, (), effect, written)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A rig whose drag is larger than it says by a fifth, with its records."""
    folder = tmp_path_factory.mktemp("paths")
    made = plan(10022, ("drag_coulomb",), size=0.2, records=2, duration=3.0, noise=0.003)
    hide(made, folder)
    rig = load(folder / "rig.toml")
    admitted = [admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])]
    torque = float(made.effects[0]["torque"].split()[0])
    return admitted, [preprocess(one) for one in admitted], torque


@pytest.mark.slow
def test_the_hidden_cause_predicts_the_path_and_a_wrong_one_is_refuted(bench):
    admitted, records, torque = bench
    right = named("drag_coulomb", torque, "N m", torque=torque)
    wrong = named("restitution_offset", -0.1, "", offset=-0.1)
    found = path_errors(records, [right, wrong], admitted, Paths().of)
    assert all(4 <= found.record.count(name) <= 8 for name in set(found.record))  # those that overlap count once
    assert found.refuted() == [False, True]
    alone = path_errors(records, [right], admitted, Paths().of)
    assert alone.refuted() == [False]
    assert not alone.left()
    assert np.sqrt(np.mean(alone.extended**2)) < 0.2 * np.sqrt(np.mean(alone.base**2))


def test_a_cause_that_explains_nothing_of_the_path_leaves_it(bench):
    admitted, records, _ = bench
    idle = named("backlash_offset", 1e-9, "m", offset=1e-9)
    (left,) = path_errors(records, [idle], admitted, Paths().of).left()
    assert left.name == "path.all"
    assert left.record in {one.name for one in records}


def test_a_record_without_noise_leaves_a_path_of_finite_significance():
    far, none = np.full(8, 2e-6), np.zeros(8)
    (left,) = PathErrors(("a",) * 8, none, far, far, np.stack([far])).left()
    assert np.isfinite(left.gain)
    assert left.size == pytest.approx(2e-6)


def test_few_windows_refute_nothing():
    far = np.full(4, 2e-6)
    assert PathErrors(("a",) * 4, far / 10, far / 2, far, np.stack([far / 2])).refuted() == [False]
    far = np.full(16, 2e-6)
    assert PathErrors(("a",) * 16, far / 10, far / 2, far, np.stack([far / 2])).refuted() == [True]


def test_a_simulated_record_is_read_as_the_measured_one(bench):
    """Same sampling, counts and noise, and flights that fall as the drag of the rig says."""
    admitted, _, _ = bench
    one = admitted[0]
    made = simulated(one, one.rig)
    columns, read = one.channels.columns, made.channels.columns
    assert len(read["time_s"]) == len(columns["time_s"])
    for name in ("theta_drive_rad", "theta_loose_rad"):
        steps = [np.diff(each[name], 2) for each in (columns, read)]
        assert np.std(steps[1]) == pytest.approx(np.std(steps[0]), rel=0.05)
    flights = preprocess(made).channels.flights
    slow = [
        2.0 * np.polyfit(time - time.mean(), angle, 2)[0]
        for time, angle in zip(flights.time, flights.loose, strict=True)
    ]
    assert np.median(slow) == pytest.approx(-one.rig.drag.torque / one.rig.rig().inertia, rel=0.02)


@pytest.mark.slow
def test_a_record_whose_long_windows_have_local_minima_is_explained():
    """Errors of the drive's motion grew over twelve low bounces, and one record of four was 20 times its noise off."""
    told = play(next(iter(cases("space", 1392, 1))))
    assert told["set_right"]
    assert told["wrong_names"] == []


@pytest.mark.slow
def test_a_torque_is_found_that_a_correction_of_the_drive_stands_for():
    """Fits began with the complete size next to the correction, and ended in another local minimum."""
    told = play(next(iter(cases("space", 1368, 1))))
    assert told["set_right"]
    assert told["wrong_names"] == []


@pytest.mark.slow
def test_errors_of_the_size_of_large_causes_are_no_further_cause():
    """Next to an encoder's error of 10,000 sigma, a torque of 10 sigma over the angle compensated what it left."""
    told = play(next(iter(cases("space2", 471, 1))))
    assert set(told["kinds_right"]) == {"encoder_eccentricity", "restitution_speed"}
    assert told["wrong_names"] == []
