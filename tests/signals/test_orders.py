"""Harmonics of an angle with known phasors: from samples with gaps, in noise of known deviation, with outliers."""

import numpy as np
import pytest

from gears3d.signals.orders import (
    chances,
    deviations,
    each_alone,
    harmonics,
    off_multiples,
    phasors_of,
    power_at,
    sums,
    trimmed,
)

ORDERS = [1, 3, 17]
TRUTH = np.array([3e-6 * np.exp(0.4j), 1e-6 * np.exp(-2.0j), 0.5e-6 * np.exp(3.0j)])


def _gaps(random, count=4000, turns=20.0):
    angle = np.sort(random.uniform(0.0, 2.0 * np.pi * turns, count))
    return angle[np.mod(angle, 2.0 * np.pi) < 4.5]


def _values(angle):
    return sum(abs(z) * np.cos(order * angle + np.angle(z)) for order, z in zip(ORDERS, TRUTH, strict=True))


def test_phasors_come_back_from_samples_with_gaps_and_outliers():
    random = np.random.default_rng(1)
    angle = _gaps(random)
    values = _values(angle) + random.normal(0.0, 1e-8, len(angle))
    values[::50] += 5e-6
    found = trimmed(harmonics(angle, ORDERS), values, 4.0, 1e-8)
    np.testing.assert_allclose(phasors_of(found.numbers), TRUTH, atol=3e-9)
    assert not found.kept[::50].any()
    assert found.kept.mean() > 0.97


def test_deviations_and_chances_of_noise_are_calibrated():
    random = np.random.default_rng(2)
    pulls, seen = [], []
    for _ in range(150):
        angle = _gaps(random, 400)
        values = random.normal(0.0, 2.0, len(angle))
        found = trimmed(harmonics(angle, ORDERS), values, 1e9, 0.0)
        covariance = 4.0 * found.inverse
        phasors = phasors_of(found.numbers)
        pulls += [*(phasors.real / deviations(covariance))]
        seen += [*chances(phasors, covariance)]
    assert np.std(pulls) == pytest.approx(1.0, abs=0.1)  # 3 standard errors of 450 are 0.10
    assert np.mean(np.array(seen) < 0.1) == pytest.approx(0.1, abs=0.05)


@pytest.mark.parametrize("bins", [0, 32])
def test_an_order_alone_is_that_of_least_squares(bins):
    angle = _gaps(np.random.default_rng(3))
    values = _values(angle)
    phasors, falls = each_alone(angle, values, 20, 1e-9, bins)
    for order in (2, 3, 20):
        columns = np.stack([np.cos(order * angle), np.sin(order * angle)], axis=1)
        (c, s), left, *_ = np.linalg.lstsq(columns, values, rcond=None)
        assert phasors[order] == pytest.approx(c - 1j * s, abs=2e-8 if bins else 1e-14)
        assert falls[order] == pytest.approx(values @ values - left[0], rel=0.05 if bins else 1e-6)


def test_sums_and_powers_are_those_of_their_definition():
    angle = _gaps(np.random.default_rng(4))
    values = _values(angle)
    exact = np.array([values @ np.exp(-1j * order * angle) for order in range(21)])
    np.testing.assert_allclose(sums(angle, values, 20), exact, atol=1e-12 * np.abs(exact).max())
    orders = np.array([0.99, 1.0, 3.02, 17.0])  # within the lobes of what is there
    power = [abs(values @ np.exp(-1j * order * angle)) ** 2 for order in orders]
    np.testing.assert_allclose(power_at(angle, values, orders, 40), power, rtol=0.05, atol=1e-3 * max(power))


def test_distance_from_multiples_is_zero_at_these_alone():
    assert off_multiples(np.array([0.0, 2.5, 5.0, 6.0]), 2.5) == pytest.approx([0.0, 0.0, 0.0, 1.0])


def test_no_sample_and_no_order_have_columns_of_their_shape():
    assert harmonics(np.zeros(0), [1, 2]).shape == (0, 4)
    assert harmonics(np.zeros(3), []).shape == (3, 0)
