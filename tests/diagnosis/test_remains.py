"""Structure over an angle: orders of neither gear are found where they are, and noise is no structure."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis.remains import _scanned
from gears3d.diagnosis.verdict import off
from tests.diagnosis.blind_tables import rate

TURNS = (10, 20, 30)
POINTS = 400


def _scan(random, size=0.0, order=5.43):
    angles = [np.sort(random.uniform(0.0, 2.0 * np.pi * turns, POINTS)) for turns in TURNS]
    waves = [size * np.cos(order * angle + random.uniform(0.0, 2.0 * np.pi)) for angle in angles]
    value = random.normal(size=POINTS * len(TURNS)) + np.concatenate(waves)
    return next(iter(_scanned("flight.angle_loose", value, np.ones(len(value)), angles, 40, "rad/s^2")))


def test_noise_is_as_seldom_structure_as_its_chance_says():
    random = np.random.default_rng(4)
    chances = np.array([_scan(random).chance for _ in range(200)])
    assert np.sum(chances < 0.01) <= 6, rate(int(np.sum(chances < 0.01)), 200)
    assert 0.35 < np.mean(chances < 0.5) < 0.65


@pytest.mark.parametrize("order", [0.7, 5.43, 17.0, 38.62])
def test_an_order_of_no_gear_is_found_whatever_its_phase_in_each_record(order):
    found = _scan(np.random.default_rng(5), 0.5, order)
    assert found.chance < 1e-9
    assert found.where == pytest.approx(order, abs=0.5 / max(TURNS))
    assert found.size == pytest.approx(0.5 / np.sqrt(2.0), rel=0.15)


OFF = ["contact"]


@pytest.mark.parametrize(("share", "size", "told"), [(0.01, 500.0, []), (0.3, 20.0, OFF), (1.0, 6.0, OFF)])
def test_a_channel_is_off_as_a_whole_and_not_by_a_few_strays(share, size, told):
    rest = np.random.default_rng(6).normal(size=4000)
    rest[: int(share * len(rest))] += size
    found = SimpleNamespace(
        known=SimpleNamespace(spans={"flight": slice(0, 0), "contact": slice(0, len(rest))}),
        fit=SimpleNamespace(rest=rest),
    )
    assert off(found) == told
