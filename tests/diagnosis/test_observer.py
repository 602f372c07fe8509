"""What an observer who knows the hidden causes sees of them."""

import numpy as np
import pytest

from gears3d.diagnosis.diagnosis import shown
from gears3d.diagnosis.evidence import Paths
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, space, taking
from tests.diagnosis import observer
from tests.diagnosis.blind import Case


def records(folder):
    rig = load(folder / "rig.toml")
    return [admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])]


def sees(admitted, plan):
    answer = plan.told()
    return observer.seen(admitted, answer["effects"], answer.get("zeros"))


@pytest.mark.slow
def test_an_encoder_in_contact_is_seen_as_a_sine_in_white_noise(tmp_path):
    plan = Case("below", 3, ("encoder_eccentricity",), (("noise", 0.003), ("duration", 4.0)), "below").plan()
    hide(plan, tmp_path)
    admitted = records(tmp_path)
    found = sees(admitted, plan)["encoder_eccentricity"]
    windows = shown(admitted, Paths(), 40).windows
    one = plan.told()["effects"][0]
    radius = windows.radii[one["gear"] == "loose"]
    assert len(windows) > 40
    white = np.sqrt(np.sum((one["amplitude"] * radius / windows.sigma) ** 2) / 2.0)
    assert 0.6 < found / white < 1.0  # zeros, starts and the correlation of the noise cost some


def test_nothing_is_seen_of_a_flank_that_is_not_reached(tmp_path):
    rig = space.draw(86, 20)[85]
    plan = taking.plan(rig, ("backlash_offset",), samples=100_000)
    hide(plan, tmp_path, observe=taking.observer(rig), stated=False)
    assert sees(records(tmp_path), plan) == {"backlash_offset": pytest.approx(0.0, abs=1e-6)}


@pytest.mark.slow
def test_what_windows_do_not_show_is_not_judged(tmp_path):
    plan = Case("below", 3, ("drive_motion",), (("noise", 0.003), ("duration", 4.0)), "below").plan()
    hide(plan, tmp_path)
    assert sees(records(tmp_path), plan) == {"drive_motion": None}
    assert observer.seen(records(tmp_path), [], None) == {}


def test_a_torque_of_unknown_exponent_is_seen_at_one_speed(tmp_path):
    """Its size and exponent are not known each on its own: 0.006 sigma were stated."""
    rig = space.draw(86, 20)[85]
    plan = taking.plan(rig, ("drag_power",), samples=100_000)
    hide(plan, tmp_path, observe=taking.observer(rig), stated=False)
    assert sees(records(tmp_path), plan)["drag_power"] > 50.0
