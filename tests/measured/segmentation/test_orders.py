"""Flanks whose strong orders nobody told: cut against the truth, and orders of the contact by least squares."""

import numpy as np
import pytest

from gears3d.measured.segmentation import contact_orders, measure
from gears3d.measured.segmentation.orders import Contact, columns_of, strongest
from gears3d.measured.segmentation.results import shares
from gears3d.scenario import load
from gears3d.simulation import record, simulate
from tests.measured.segmentation.truth import FIG5, cut, judged, seen

WAVES = [
    [(7, "4 um")],
    [(17, "10 um")],
    [(7, "6 um"), (17, "3 um"), (90, "1 um")],
]


def wavy(waves, swing, duration="4 s"):
    effects = [{"kind": "transmission_error", "order": o, "amplitude": a, "phase": "10 deg"} for o, a in waves]
    changes = {"run.duration": duration, "run.output_rate": "50 kHz", "sensors.sample_rate": "50 kHz"}
    changes["motion.harmonics"] = [{"amplitude": swing, "frequency": "3 Hz"}]
    return load(FIG5, {**changes, "effect": effects})


@pytest.mark.parametrize("waves", WAVES)
@pytest.mark.parametrize("noise", [pytest.param(0.001, marks=pytest.mark.slow), 0.015])
def test_flanks_have_the_orders_that_the_record_asks_for(waves, noise):
    scenario = wavy(waves, "20 rpm")
    truth = simulate(scenario, "rigid")
    found = cut(scenario, seen(scenario, truth, noise, seed=41))
    told = judged(truth, found, 30 * found.flanks.rough)
    assert told["found"] >= 0.95 * told["high"] > 20
    assert told["in_time"] == told["flank"] == told["found"]
    assert told["invented"] == 0
    assert told["flanks_right"] >= 0.995
    assert np.median(found.flights["chi2"]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("waves", WAVES)
def test_waves_of_flanks_are_no_rattle(waves):
    scenario = wavy(waves, "0 rpm")
    truth = simulate(scenario, "rigid")
    found = cut(scenario, seen(scenario, truth, 0.001, seed=42))
    assert not len(truth.impacts["time_s"])
    assert not len(found.impacts["time_s"])
    assert found.flanks.rough < 1.2 * found.path.noise


def test_orders_of_the_contact_are_those_of_the_flanks_with_honest_sigmas():
    scenario = wavy(WAVES[2], "0 rpm")
    truth = simulate(scenario, "rigid")
    found = contact_orders(measure(seen(scenario, truth, 0.001, seed=43), scenario))
    assert sorted(found["order"].tolist()) == [7, 17, 90]
    true = {7: 6e-6, 17: 3e-6, 90: 1e-6}
    pulls = [(a - true[o]) / s for a, o, s in zip(found["amplitude_m"], found["order"], found["sigma_m"], strict=True)]
    assert np.max(np.abs(pulls)) < 4.0
    assert np.max(found["sigma_m"]) < 0.05e-6


@pytest.mark.slow
def test_orders_come_from_the_contact_of_a_rattling_record_too():
    scenario = wavy(WAVES[1], "20 rpm")
    for flank in (0, 1):
        found = contact_orders(measure(record(scenario, seed=44), scenario), flank)
        assert found["order"][0] == 17
        assert found["amplitude_m"][0] == pytest.approx(10e-6, rel=0.05)


def test_shares_are_parts_even_where_two_orders_nearly_cancel():
    angle = np.linspace(0.0, 0.5, 2000)  # gears touch over a twelfth of a turn: orders 1 and 2 look alike there
    base = np.ones((len(angle), 1))
    noise = np.random.default_rng(5).normal(0.0, 1e-8, len(angle))
    place = 1e-5 * np.cos(angle) - 1e-5 * np.cos(2 * angle + 0.1) + noise
    touched = Contact(base, np.stack([angle, angle]), place, 1e-8)
    taken = [("drive", 1), ("drive", 2)]
    numbers = np.linalg.lstsq(columns_of(touched, taken), place, rcond=None)[0]
    plain = 0.5 * np.hypot(numbers[1::2], numbers[2::2]) ** 2 / np.var(place)
    found = shares(touched, taken, numbers)
    assert plain.max() > 1.0
    assert ((found >= 0.0) & (found <= 1.0)).all()


def test_the_share_of_a_lone_order_is_its_part_of_the_variance():
    angle = np.linspace(0.0, 20 * np.pi, 4000, endpoint=False)
    place = 1e-5 * np.cos(3 * angle) + np.random.default_rng(6).normal(0.0, 1e-5, len(angle))
    touched = Contact(np.ones((len(angle), 1)), np.stack([angle, angle]), place, 1e-5)
    numbers = np.linalg.lstsq(columns_of(touched, [("drive", 3)]), place, rcond=None)[0]
    assert shares(touched, [("drive", 3)], numbers) == pytest.approx([1 / 3], abs=0.03)


def test_orders_of_two_flanks_are_found_where_fewer_records_touch_one_of_them():
    """Each record has an offset of its own: the flanks then differ in their numbers of base columns."""
    random = np.random.default_rng(5)
    wave = 6e-6 + 0.0j
    touched = []
    for records in (1, 2):
        drive = np.linspace(0.0, 12.0 * np.pi, 1500)
        of = np.arange(len(drive)) * records // len(drive)
        base = np.eye(records)[of]
        place = base @ np.arange(records) * 3e-6 + np.real(wave * np.exp(7j * drive))
        place += 0.2e-6 * random.normal(size=len(drive))
        touched.append(Contact(base, np.stack([drive, drive * 23 / 41]), place, 0.2e-6))
    taken, numbers, covariance = strongest(touched, (20, 0))
    assert taken == [("drive", 7)]
    for records, own, spread in zip((1, 2), numbers, covariance, strict=True):
        assert len(own) == records + 2
        deviation = np.sqrt(spread[records, records])
        assert deviation < 0.05e-6
        assert abs(own[records] - wave.real) < 4.0 * deviation
