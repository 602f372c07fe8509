"""A long record is worked out in pieces; what comes out is what would come out at once."""

import numpy as np
import pytest

from gears3d.measured.segmentation import displacement, measure, measured, track
from gears3d.measured.segmentation.orders import _out_of_reach
from gears3d.recording import Derived, read
from tests.measured.segmentation.truth import happened, seen


@pytest.fixture(scope="module")
def rattle():
    scenario, truth = happened(0.3, 60e-6, duration="2 s")
    return scenario, seen(scenario, truth, 0.015, 11)


@pytest.mark.slow
def test_columns_made_on_demand_are_those_made_at_once(rattle, monkeypatch, tmp_path):
    scenario, record = rattle
    whole = measure(record, scenario)
    assert isinstance(whole.recording.signals, dict)
    monkeypatch.setattr(measured, "LONG", 2000)
    monkeypatch.setattr(displacement, "AT_ONCE", 3000)
    pieces = measure(record, scenario)
    assert isinstance(pieces.recording.signals, Derived)
    assert list(pieces.recording.signals) == list(whole.recording.signals)
    for name, values in whole.recording.signals.items():
        np.testing.assert_allclose(pieces.recording.signals[name], values, rtol=0, atol=1e-12, err_msg=name)
    for name, values in whole.recording.impacts.items():
        np.testing.assert_allclose(pieces.recording.impacts[name], values, rtol=1e-9, atol=1e-12, err_msg=name)
    pieces.recording.write(tmp_path / "run")
    again = read(tmp_path / "run")
    np.testing.assert_array_equal(again.signals["displacement_m"], pieces.recording.signals["displacement_m"])
    assert again.meta == pieces.recording.meta


def test_nothing_as_long_as_the_record_is_kept(rattle):
    scenario, record = rattle
    rig = scenario.rig()
    angles = (record.signals["theta_drive_rad"], record.signals["theta_loose_rad"])
    known = track(record.time, *angles, (rig.base_radius_drive, rig.base_radius_loose))
    assert known.readings[1].kind == "counts"
    assert np.shares_memory(known.shown, angles[1])
    assert np.shares_memory(known.readings[0].shown, angles[0])
    rows = slice(100, 200)
    for part, whole in zip(known.part(rows), (known.drive, known.loose, known.place), strict=True):
        np.testing.assert_allclose(part, whole[rows], rtol=0, atol=1e-15)
    amid = 0.5 * (record.time[100:199] + record.time[101:200])
    drive, loose = known.angles(amid)
    np.testing.assert_allclose(loose, np.interp(amid, record.time, known.loose), rtol=0, atol=1e-13)
    np.testing.assert_allclose(drive, np.interp(amid, record.time, known.drive), rtol=0, atol=1e-13)


def test_orders_that_cannot_explain_a_path_are_not_gone_through():
    rest = np.full(1000, 1.0)
    fits = [(None, None, rest, 1.0)]
    assert _out_of_reach(fits, power=20.0, room=16, goal=0.5)  # 1000 - 2·16·20 > 250
    assert not _out_of_reach(fits, power=30.0, room=16, goal=0.5)
    assert not _out_of_reach(fits, power=0.0, room=16, goal=0.0)
