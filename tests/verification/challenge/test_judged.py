"""The judge of the operating space: it must notice when a measurement and the truth differ."""

from dataclasses import replace

import numpy as np
import pytest

from gears3d.measured.segmentation import measure
from gears3d.verification.challenge.space import draw
from gears3d.verification.challenge.taking import take
from tests.verification.challenge.judged import compared, judge


@pytest.fixture(scope="module")
def measured():
    taken = take(draw(33, 1)[32], dirt=False, samples=60_000)
    return taken.truth, measure(taken.record, taken.scenario)


def test_what_is_measured_well_is_right(measured):
    row = compared(*measured)
    assert (row["verdict"], row["why"], row["backlash"]) == ("right", "", "right")
    assert row["found_clear"] == row["clear"] > 30


@pytest.mark.parametrize(("size", "verdict"), [(1.05, "wrong"), (1.005, "right")])
def test_another_backlash_is_wrong_where_it_matters(measured, size, verdict):
    truth, found = measured
    row = compared(replace(truth, backlash=size * truth.backlash), found)
    assert row["backlash"] == ("wrong" if verdict == "wrong" else "narrow")
    assert row["verdict"] == verdict


def test_impacts_that_are_not_there_are_invented_and_others_missed(measured):
    truth, found = measured
    late = dict(truth.impacts, time_s=truth.impacts["time_s"] + 0.25 * truth.period)
    row = compared(replace(truth, impacts=late), found)
    assert "missed impacts" in row["why"]
    assert "invented impacts" in row["why"]


def test_other_speeds_and_flanks_are_wrong(measured):
    truth, found = measured
    fast = dict(truth.impacts, velocity_m_s=1.5 * truth.impacts["velocity_m_s"])
    assert compared(replace(truth, impacts=fast), found)["why"] == "speeds"
    swapped = dict(truth.impacts, flank=1 - truth.impacts["flank"])
    assert "flanks" in compared(replace(truth, impacts=swapped), found)["why"]


def test_a_drive_that_is_followed_has_a_small_error(measured):
    truth, found = measured
    assert compared(truth, found)["drive_error"] < 0.05
    (size, w, phase), *more = truth.sines
    late = ((size, w, phase + 1.0), *more)
    assert compared(replace(truth, sines=late), found)["drive_error"] > 0.5


def test_another_regime_is_wrong(measured):
    truth, found = measured
    one = truth.impacts["flank"] == 0
    kept = {name: values[one] for name, values in truth.impacts.items()}
    row = compared(replace(truth, impacts=kept), found)
    assert "regime double_sided for single_sided" in row["why"]
    assert (
        row["invented"] > np.sum(~one & (truth.impacts["flight_height_m"] > found.summary["flight_height_min_m"])) / 2
    )


def test_a_record_is_judged_from_its_file_to_its_laws():
    row = judge(take(draw(114, 1)[113], dirt=False, samples=20_000))
    assert (row["stage"], row["regime"]) == ("measured", row["true_regime"])
    verdicts = {name: law[name] for name, law in row["laws"].items()}
    assert set(verdicts) == {"restitution", "backlash", "transmission_error"}
    assert set(verdicts.values()) <= {"right", "silent", "narrow", "wrong"}
