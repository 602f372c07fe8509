"""Losses of contact and readings in time: against the twin's own records and closed forms."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import added, loss_sigma, preprocess, residuals
from gears3d.diagnosis.evidence import _without_delay, evidence
from gears3d.diagnosis.pitch_error import without_teeth
from gears3d.diagnosis.preprocessing import delay_of
from gears3d.diagnosis.search import without_rolling, without_strays
from gears3d.effects import catalogue
from gears3d.measured.segmentation import measure
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import record

BENCH = {"run.duration": "3 s", "sensors.sample_rate": "20 kHz", "sensors.loose.noise": "5e-6 rad",
         "sensors.drive.noise": "5e-6 rad"}  # fmt: skip


def left(effects, noise="5e-6 rad"):
    """Return the losses of a record of the twin as evidence about the rig without the effects."""
    noises = {f"sensors.{gear}.noise": noise for gear in ("drive", "loose")}
    plain = load("scenarios/rigaud-2020/fig5-20rpm.toml", BENCH | noises)
    rig = plain.with_({"effect": effects}) if effects else plain
    return evidence(measure(record(rig), plain), plain)


def test_flanks_are_left_at_rest_where_contact_has_no_torque_of_its_own():
    seen = left([])
    rest = residuals(seen)["loss"]
    assert len(rest) > 12
    assert set(seen.channels.losses.flank) == {0, 1}
    assert abs(np.mean(rest)) < 1.0
    assert np.std(rest) < 2.0


@pytest.mark.parametrize("coefficient", [0.04, 0.1])
def test_drag_of_the_mesh_leaves_the_active_flank_late_by_what_is_predicted(coefficient):
    seen = left([{"kind": "mesh_drag", "coefficient": f"{coefficient} N m s/rad"}])
    before, flank = residuals(seen)["loss"], seen.channels.losses.flank
    predicted = added(seen, [catalogue()["mesh_drag"](coefficient=coefficient)], "loss")
    assert np.all(predicted[flank == 1] == 0.0)
    assert abs(np.mean(before[flank == 1])) < 1.0
    found, told = np.median(before[flank == 0]), np.median(predicted[flank == 0])
    assert found < -5.0
    assert told == pytest.approx(found, rel=0.05)


@pytest.mark.parametrize("order", [3, 8])
def test_drag_over_the_angle_bends_flights_and_moves_what_they_are_followed_back_to(order):
    table = {"kind": "drag_position", "amplitude": "0.08 N m", "order": order, "phase": "0.4 rad"}
    seen = left([table])
    effect = catalogue()["drag_position"](amplitude=0.08, order=order, phase=0.4)
    before, predicted = (loss_sigma(seen) * part for part in (residuals(seen)["loss"], added(seen, [effect], "loss")))
    assert np.ptp(before) > 4e-4
    assert np.corrcoef(before, predicted)[0, 1] > 0.95
    assert np.std(before - predicted) < 0.3 * np.std(before)


@pytest.mark.slow
@pytest.mark.parametrize(("order", "amplitude"), [(3, 2e-3), (8, 1e-3)])
def test_a_wave_of_the_encoder_bends_flights_and_moves_what_they_are_followed_back_to(order, amplitude):
    wave = {"gear": "loose", "amplitude": f"{amplitude} rad", "order": order, "phase": "0.4 rad"}
    seen = left([{"kind": "encoder_eccentricity", **wave}], noise="2e-6 rad")
    effect = catalogue()["encoder_eccentricity"](amplitude=amplitude, order=order, phase=0.4, gear="loose")
    # in m/s: in standard deviations, which hold the scatter of each flank, noise of the flank on which the wave hardly
    # shows counts as much as the wave itself on the other
    before, predicted = (loss_sigma(seen) * part for part in (residuals(seen)["loss"], added(seen, [effect], "loss")))
    assert np.ptp(before) > 1e-4
    assert np.corrcoef(before, predicted)[0, 1] > 0.95
    assert np.std(before - predicted) < 0.35 * np.std(before)


def test_drag_that_follows_the_speed_makes_no_loss_late():
    table = {"kind": "drag_viscous", "coefficient": "0.2 N m s/rad"}
    seen = left([table])
    assert np.all(seen.channels.losses.curved > 1.0)  # flights tell the slope, and are followed back with it
    before = residuals(seen)["loss"]
    rest = before - added(seen, [catalogue()["drag_viscous"](coefficient=0.2)], "loss")
    assert np.abs(rest).max() < 3.0
    assert abs(np.mean(rest)) < 1.0


@pytest.mark.parametrize("delay", [7.3e-5, -4.1e-5, 1e-6])
def test_a_gear_that_is_read_late_is_read_in_time(delay):
    time = np.arange(4000) * 2e-5
    drive = 5.0 * time + 0.01 * np.sin(30.0 * time)
    late = 3.0 * (time - delay) + 0.02 * np.sin(50.0 * (time - delay))
    made = _without_delay(Recording({"time_s": time, "theta_drive_rad": drive, "theta_loose_rad": late}), delay)
    rows = round(delay / 2e-5) * 2e-5
    then = made.time - (delay - rows)  # of which both gears are told
    assert made.signals["theta_loose_rad"] == pytest.approx(3.0 * then + 0.02 * np.sin(50.0 * then), abs=1e-12)
    assert made.signals["theta_drive_rad"] == pytest.approx(5.0 * then + 0.01 * np.sin(30.0 * then), abs=1e-8)


def test_a_delay_is_one_that_most_records_have_and_that_nobody_corrected():
    def seen(*sizes, corrected=False):
        found = [SimpleNamespace(kind="skew", size=size, corrected=corrected) for size in sizes]
        return SimpleNamespace(findings=found)

    assert delay_of([seen(1e-5), seen(3e-5), seen()]) == pytest.approx(2e-5)
    assert delay_of([seen(1e-5), seen()]) == 0.0
    assert delay_of([seen(1e-5, corrected=True)] * 3) == 0.0


def test_flanks_are_cut_along_a_tooth_that_stands_out_once_it_is_known():
    plain = load("scenarios/rigaud-2020/fig5-20rpm.toml", {**BENCH, "run.duration": "8 s", "motion.mean": "31.7 rpm"})
    tooth = {"kind": "pitch_error", "offset": "20 um", "tooth": 7}
    played = record(plain.with_({"effect": [tooth]}))
    came = SimpleNamespace(recording=played, rig=plain, file="", stated=frozenset({"mean", "harmonics"}))
    guess = catalogue()["pitch_error"](offset=30e-6, tooth=7)
    effect = catalogue()["pitch_error"](offset=20e-6, tooth=7)
    seen = preprocess(came, 0.0, (guess,))
    before = residuals(seen)["contact"]
    rest = before - added(seen, [effect], "contact")
    assert np.count_nonzero(np.abs(before) > 10.0) > 20
    assert np.count_nonzero(np.abs(rest) > 10.0) < 0.2 * np.count_nonzero(np.abs(before) > 10.0)


def test_blows_where_a_single_tooth_is_in_mesh_are_left_out():
    seen = left([])
    teeth = [
        catalogue()["pitch_error"](offset=2e-5, tooth=4),
        catalogue()["pitch_error"](offset=2e-5, tooth=9, gear="loose"),
    ]
    kept = without_teeth(seen, teeth)
    for name in ("impacts", "censored_impacts"):
        before, after = getattr(seen.channels, name), getattr(kept.channels, name)
        near = np.zeros(len(before.time), bool)
        for gear, number in (("drive", 4), ("loose", 9)):
            pitch = 2.0 * np.pi / seen.pair.gear(gear).teeth
            away = getattr(before, gear) - (number - 1) * pitch
            near |= np.abs(np.angle(np.exp(1j * away))) < 2.25 * pitch
        assert 0 < np.count_nonzero(near) < len(near)
        assert after.time.tolist() == before.time[~near].tolist()
    out = len(seen.channels.impacts.time) - len(kept.channels.impacts.time)
    assert kept.channels.left_out["impact"] == seen.channels.left_out.get("impact", 0) + out
    assert kept.channels.losses is seen.channels.losses


def test_a_few_flights_that_are_none_are_left_out():
    seen = left([])
    late = seen.channels.flights.loose.copy()
    x = seen.channels.flights.time - seen.channels.flights.time.mean(axis=1, keepdims=True)
    late[2] += 30.0 * x[2] ** 2
    many = 3  # of a flight each, so that there are enough to tell the usual from the others
    flights = seen.channels.flights._replace(loose=late)
    flights = type(flights)(*(np.concatenate([column] * many) for column in flights))
    fine = tuple(np.concatenate([column] * many) for column in seen.fine)
    seen = replace(
        seen, channels=seen.channels._replace(flights=flights), fine=fine, at=np.concatenate([seen.at] * many)
    )
    kept = without_strays(seen)
    assert len(kept.channels.flights.time) == len(seen.channels.flights.time) - many
    assert kept.channels.left_out["flight"] == many
    assert np.abs(residuals(kept)["flight"]).max() < 8.0


def test_flights_cut_wrongly_show_once_what_bends_all_readings_is_known():
    seen = left([])
    many = 12 // len(seen.channels.flights.time) + 1  # of each, so that there are enough to tell the usual from others
    flights = type(seen.channels.flights)(*(np.concatenate([column] * many) for column in seen.channels.flights))
    fine = tuple(np.concatenate([column] * many) for column in seen.fine)
    channels = seen.channels._replace(flights=flights)
    seen = replace(seen, channels=channels, fine=fine, at=np.concatenate([seen.at] * many))
    count, x = len(flights.time), flights.time - flights.time.mean(axis=1, keepdims=True)
    known = np.zeros(len(added(seen, (), "flight")))
    known[1 * x.shape[1] : 2 * x.shape[1]] = (30.0 * x[1] ** 2) / flights.sigma[1]
    rest = residuals(seen)["flight"] + known
    bends = 200.0 * np.random.default_rng(2).normal(size=(count, 1))
    assert without_rolling([seen], rest + (bends * x**2 / flights.sigma).ravel()) is None
    (kept,) = without_rolling([seen], rest) or [seen]
    assert len(kept.channels.flights.time) == count - 1
