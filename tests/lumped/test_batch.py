"""Batches of the rigid model are the model itself, point by point and to the bit."""

import threading
from math import pi

import numpy as np
import pytest

from gears3d.effects import Rig
from gears3d.lumped import tally
from gears3d.lumped.batch import ALL, DONE, TOO_LONG, Batch, pack_points
from gears3d.lumped.repeating import cycle_of
from gears3d.signals import FLIGHT_HEIGHT_MIN, counted, impacts_per_period, periodicity
from tests.lumped.rig import model, run

RPM = pi / 30
TIMES = (40, 10, 8)


def draw(count, seed=0):
    """Return quantities of points about the bench of Rigaud & Perret-Liaudet 2020."""
    rng = np.random.default_rng(seed)
    return {
        "mean": rng.uniform(60, 90, count) * RPM,
        "amplitude": np.exp(rng.uniform(np.log(0.5), np.log(50.0), count)) * RPM,
        "frequency": rng.uniform(1.0, 10.0, count),
        "phase": rng.uniform(0.0, 2 * pi, count),
        "torque": rng.uniform(0.1, 0.8, count),
        "restitution": rng.choice([0.0, 0.3, 0.6], count),
        "stick_velocity": rng.choice([1e-4, 1e-5], count),
        "backlash": rng.uniform(100e-6, 300e-6, count),
        "inertia": rng.uniform(0.05, 0.09, count),
        "seed": rng.integers(0, 2**40, count).astype(float),
    }


def packed_alone(q, i):
    rig = Rig(
        0.148, 0.148, q["inertia"][i], q["torque"][i], q["backlash"][i], q["restitution"][i], q["mean"][i], 90, 90
    )
    sine = (q["amplitude"][i], q["frequency"][i], q["phase"][i])
    return model(rig, [sine], stick_velocity=q["stick_velocity"][i], seed=int(q["seed"][i]))


def ran(table, q, **more):
    start = np.zeros(len(table), dtype=int)
    batch = Batch(table, 1.0 / q["frequency"], TIMES, more.pop("start", start), **more)
    batch.run()
    return batch


@pytest.fixture(scope="module")
def points():
    q = draw(60)
    table = pack_points(packed_alone(q, 0).flat(), q)
    return q, table, ran(table, q)


def test_points_packed_at_once_are_points_packed_alone(points):
    q, table, _ = points
    for i in range(len(table)):
        np.testing.assert_array_equal(table[i], packed_alone(q, i).flat())


def test_a_point_does_not_know_its_neighbours(points):
    q, table, whole = points
    for part in (slice(0, 7), slice(7, 8), slice(8, 60)):
        again = ran(table[part], {name: values[part] for name, values in q.items()})
        np.testing.assert_array_equal(again.found, whole.found[part])
        np.testing.assert_array_equal(again.sections, whole.sections[part])
    back = ran(table[::-1], {name: values[::-1] for name, values in q.items()})
    np.testing.assert_array_equal(back.found[::-1], whole.found)


def test_counts_are_those_of_the_impacts_of_a_run(points):
    q, _, whole = points
    assert np.all(whole.status == DONE)
    seen = set()
    for i in range(len(whole.found)):
        period = 1.0 / q["frequency"][i]
        begin, end = TIMES[1] * period, TIMES[0] * period
        outcome = run(packed_alone(q, i), end)
        hits = dict(zip(("time_s", "flank", "velocity_m_s"), outcome.impacts.T[:3], strict=True))
        some = counted(hits | {"flight_height_m": outcome.impacts[:, 6]}, begin, end)
        numbers = whole.found[i]
        for flank in (0, 1):
            speeds = some["velocity_m_s"][some["flank"] == flank]
            assert numbers[tally.COUNT + flank] == len(speeds)
            if len(speeds):
                assert numbers[tally.MEAN + flank] == pytest.approx(speeds.mean(), rel=1e-9)
                spread = np.sqrt(numbers[tally.SPREAD + flank] / len(speeds))
                assert spread == pytest.approx(speeds.std(), rel=1e-6, abs=1e-10)
                assert numbers[tally.LARGEST + flank] == pytest.approx(np.abs(speeds).max(), rel=1e-9)
        told = periodicity(some["time_s"], some["flank"], some["velocity_m_s"], period, begin, end)
        expected = (told or tally.UNKNOWN) if len(some["time_s"]) else 0
        assert numbers[tally.REPETITION] == expected
        seen.add(expected)
        each = impacts_per_period(some["time_s"], period, begin, end)
        assert (numbers[0] + numbers[1]) / (TIMES[0] - TIMES[1]) == pytest.approx(each, abs=0.04)
        opening = some["flight_height_m"].max(initial=0.0)
        assert numbers[tally.OPENING] == pytest.approx(opening, rel=1e-9)
        assert opening == 0.0 or opening > FLIGHT_HEIGHT_MIN
    assert {0, 1} <= seen


def test_energy_is_what_the_impacts_take(points):
    q, _, whole = points
    i = int(np.argmax(whole.found[:, tally.ENERGY]))
    end = TIMES[0] / q["frequency"][i]
    hits = run(packed_alone(q, i), end).impacts
    hits = hits[(hits[:, 0] >= TIMES[1] / q["frequency"][i]) & (hits[:, 6] > FLIGHT_HEIGHT_MIN)]
    lost = 0.5 * q["inertia"][i] / 0.148**2 * np.sum(hits[:, 2] ** 2 - hits[:, 3] ** 2)
    assert whole.found[i, tally.ENERGY] == pytest.approx(lost, rel=1e-9)


def test_sections_are_states_once_a_period(points):
    q, _, whole = points
    i = int(np.argmax(whole.found[:, tally.OPENING]))
    period = 1.0 / q["frequency"][i]
    outcome = run(packed_alone(q, i), TIMES[0] * period, spacing=period)
    first = TIMES[0] - TIMES[2]
    np.testing.assert_allclose(whole.sections[i, :, tally.PLACE], outcome.samples[first:-1, 5], atol=1e-12)
    np.testing.assert_allclose(whole.sections[i, :, tally.RATE], outcome.samples[first:-1, 6], atol=1e-9)


def test_a_followed_motion_of_equal_points_goes_on_as_one_run():
    q = {name: np.repeat(values[:1], 3) for name, values in draw(1, 5).items()}
    q["amplitude"][:], q["restitution"][:], q["frequency"][:] = 20 * RPM, 0.6, 3.0
    table = pack_points(packed_alone(q, 0).flat(), q)
    chain = ran(table, q, follow=True)
    long = Batch(table[:1], 1.0 / q["frequency"][:1], (120, 90, 8), np.zeros(1, dtype=int))
    long.run()
    np.testing.assert_allclose(chain.found[2, :8], long.found[0, :8], rtol=1e-6)
    np.testing.assert_allclose(chain.sections[2], long.sections[0], atol=1e-9)


def test_what_never_ends_is_stopped():
    q = draw(3)
    q["amplitude"][:], q["restitution"][:], q["stick_velocity"][:] = 20 * RPM, 1.0, 0.0
    table = pack_points(packed_alone(q, 0).flat(), q)
    batch = Batch(table, 1.0 / q["frequency"], (10**7, 1, 1), np.zeros(3, dtype=int))
    batch.stop[0] = 0

    def stop_all():
        while batch.cursor[0] == 0:
            pass
        batch.stop[0] = ALL

    thread = threading.Thread(target=stop_all, daemon=True)
    thread.start()
    assert batch.run() == 1
    thread.join()
    assert batch.status[:2].tolist() == [TOO_LONG, TOO_LONG]


def test_a_cycle_stands_for_all_that_follow_it():
    q, times, strobe = draw(80, 7), (150, 60, 20), 0.25
    q["backlash"][40:], q["restitution"][40:] = 0.5, 0.0  # too far to cross: flights of several periods fall back
    table = pack_points(packed_alone(q, 0).flat(), q)
    period = 1.0 / q["frequency"]
    batch = Batch(table, period, times, np.zeros(80, dtype=int), strobe=strobe)
    batch.run()
    lengths = set()
    for i in range(80):
        outcome = run(packed_alone(q, i), times[0] * period[i], spacing=strobe * period[i])
        found = cycle_of(outcome.contacts, len(outcome.contacts), period[i])
        if not found:
            continue
        lengths.add(found)
        hits = outcome.impacts[
            (outcome.impacts[:, 0] >= times[1] * period[i]) & (outcome.impacts[:, 6] > FLIGHT_HEIGHT_MIN)
        ]
        for flank in (0, 1):
            mine = hits[hits[:, 1] == flank]
            assert batch.found[i, tally.COUNT + flank] == len(mine)
            assert batch.found[i, tally.IMPULSE + flank] == pytest.approx(mine[:, 4].sum(), rel=1e-9)
        at = 4 * np.arange(times[0] - times[2], times[0]) + 1
        for column, name, least in ((5, tally.PLACE, 1e-12), (6, tally.RATE, 1e-9)):
            np.testing.assert_allclose(batch.sections[i, :, name], outcome.samples[at, column], atol=least)
    assert lengths >= {1, 2}


@pytest.mark.parametrize(
    ("ends", "length"),
    [([0.2, 1.2], 1), ([0.2, 2.2, 4.2], 2), ([0.2, 1.2, 4.2], 3), ([0.2, 1.3], 0), ([0.2, 1.2 + 1e-6], 0), ([0.2], 0),
     ([0.2, 9.2], 0)],
)  # fmt: skip
def test_a_cycle_is_whole_periods_between_losses_of_the_active_flank(ends, length):
    rows = [(0.0, end - 0.1, end) for end in ends]
    other = [(1.0, end - 0.3, end - 0.2) for end in ends]
    contacts = np.array(sorted(rows + other, key=lambda row: row[2]))
    assert cycle_of(contacts, len(contacts), 1.0) == length
    assert cycle_of(np.array(other), len(other), 1.0) == 0
