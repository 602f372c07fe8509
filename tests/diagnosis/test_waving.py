"""Orders of a torque in the paths of flights: found where they are, at their size, and noise has none."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import BINS, project_out
from gears3d.diagnosis.channels import FlickerNoise
from gears3d.diagnosis.evidence import _fine_grid
from gears3d.diagnosis.residual_patterns import flight_order_spectrum
from tests.diagnosis.blind_tables import rate

SPEEDS = (9.0, 14.0, 23.0)
FLIGHTS, SIGMA = 90, 2e-6
SMALL = {"count": 30, "highest": 12}
"""Less to look through, for what is asked of many seeds and holds of any number of flights and orders."""


def _record(random, speed, size, order, lasts=(0.02, 0.12), begins=None, count=FLIGHTS):
    """Flights at a speed under a deceleration that goes by an order of the angle, in closed form."""
    first = np.sort(random.uniform(0.0, 12.0, count)) if begins is None else begins
    time = first[:, None] + random.uniform(*lasts, count)[:, None] * np.linspace(0.0, 1.0, BINS)
    phase = random.uniform(0.0, 2.0 * np.pi)
    path = size / (order * speed) ** 2 * np.cos(order * speed * time + phase) + SIGMA * random.normal(size=time.shape)
    flights = SimpleNamespace(time=time, loose=speed * time + path, sigma=np.full(time.shape, SIGMA))
    fine, at = _fine_grid(SimpleNamespace(flights=flights))
    x = time - time.mean(axis=1, keepdims=True)
    rest = project_out(path / SIGMA, (np.ones_like(x), x)).ravel()
    return SimpleNamespace(
        channels=SimpleNamespace(flights=flights, flicker=FlickerNoise()), fine=fine, at=at, cache={}
    ), rest


def _found(random, size=0.0, order=5.43, locked=(0.0, 0.0, 0.0), highest=40, **about):
    seen = [_record(random, speed, size, order, **about) for speed in SPEEDS]
    records, rest = [one for one, _ in seen], [own for _, own in seen]
    angle = [one.fine[1] for one in records]
    return next(iter(flight_order_spectrum("flight.angle_loose", records, rest, angle, highest, locked)), None)


def _chance(found):
    return 1.0 if found is None else found.chance


@pytest.mark.parametrize("order", [0.7, 2.38, 5.43, 11.7, 23.0])
def test_an_order_is_found_where_it_is_and_as_large_though_flights_turn_by_many_of_its_periods(order):
    size = 0.2 * max(order / 2.38, 1.0) ** 2
    found = _found(np.random.default_rng(5), size, order)
    assert found.chance < 1e-9
    assert found.where == pytest.approx(order, abs=0.02)
    assert found.size == pytest.approx(size / np.sqrt(2.0), rel=0.1)


def test_noise_is_as_seldom_structure_as_its_chance_says():
    random = np.random.default_rng(4)
    chances = np.array([_chance(_found(random, **SMALL)) for _ in range(60)])
    assert np.sum(chances < 0.01) <= 3, rate(int(np.sum(chances < 0.01)), 60)
    assert np.mean(chances < 0.5) < 0.7


def test_flights_that_all_begin_alike_make_no_structure_of_noise():
    random = np.random.default_rng(6)
    begins = np.arange(SMALL["count"]) * 2.0 * np.pi / 9.0  # the same angle again and again at the first speed
    chances = [_chance(_found(random, begins=begins, lasts=(0.05, 0.0501), **SMALL)) for _ in range(30)]
    assert np.sum(np.array(chances) < 1e-3) <= 1


def test_what_comes_back_with_the_drive_is_no_order():
    assert _found(np.random.default_rng(8), 0.2).where == pytest.approx(5.43, abs=0.02)
    assert _found(np.random.default_rng(8), 0.2, locked=(2.715, 2.715, 2.715)) is None


def test_an_order_that_most_records_bend_by_goes_before_one_that_gains_more_in_two():
    """In the last two, which tell nothing of the first order, another gains more than the first in all others."""
    random = np.random.default_rng(9)
    seen = [_record(random, speed, 0.2, 5.43) for speed in SPEEDS]
    seen += [_record(random, speed, 3.0, 1.9) for speed in (4.0, 4.6)]
    records, rest = [one for one, _ in seen], [own for _, own in seen]
    angle = [one.fine[1] for one in records]
    (found,) = flight_order_spectrum("flight.angle_loose", records, rest, angle, 40, [0.0] * 3 + [5.43, 5.43])
    assert found.where == pytest.approx(5.43, abs=0.02)
    assert found.size == pytest.approx(0.2 / np.sqrt(2.0), rel=0.1)
