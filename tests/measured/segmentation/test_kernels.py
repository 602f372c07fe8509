"""The compiled loops of measuring against plain numpy."""

import numpy as np
import pytest

from gears3d.measured.segmentation import Reading, Terms, Track, steady
from gears3d.measured.segmentation.flanks import turned
from gears3d.measured.segmentation.parabolas import Law, bend, fit, slope_within

TIME = np.arange(12_000) / 5e3
LIFT = 2e-3
"""What angles are above what is shown [rad]."""


def _track(angle, sigma):
    smooth = Reading(TIME, angle - LIFT, sigma, None, "smooth", LIFT)
    return Track(TIME, smooth.shown, steady(smooth), True, sigma, 1e-6, 0.0, (0.1, 0.1), (smooth, smooth), 2e-4)


@pytest.mark.parametrize("slope", [0.0, 0.4])
@pytest.mark.parametrize("law", [None, Law(1.0, 0.1, 2.0, 0.05, (0.5, 2.5))])
def test_paths_are_those_of_plain_least_squares(slope, law):
    random = np.random.default_rng(3)
    sigma = 1e-5 * (1.0 + random.random(len(TIME)))
    known = _track(3.0 * TIME - 0.5 * TIME**2 + sigma * random.normal(size=len(TIME)), sigma)
    first, last = np.array([10, 500, 1000, 5000]), np.array([400, 520, 4000, 11_000])
    found = fit(known, first, last, slope, law)
    for k, (begin, end) in enumerate(zip(first, last, strict=True)):
        part = slice(begin, end + 1)
        half = 0.5 * (TIME[end] - TIME[begin])
        x = (TIME[part] - 0.5 * (TIME[end] + TIME[begin])) / half
        rows = np.column_stack([np.ones_like(x), x, bend(x, slope * half)[0]])
        rows, right = rows / sigma[part, None], known.loose[part] / sigma[part]
        if law is not None:  # one more row for what is expected of the bend
            turned = (known.loose[end] - known.loose[begin]) / (2.0 * half)
            tight = 1.0 / (0.5 * half**2 * law.varies)
            rows = np.vstack([rows, [0.0, 0.0, tight]])
            right = np.append(right, -tight * 0.5 * half**2 * law.at(turned))
        numbers = np.linalg.lstsq(rows, right, rcond=None)[0]
        covariance = np.linalg.inv(rows.T @ rows)
        assert found.numbers[k] == pytest.approx(numbers, rel=1e-9, abs=1e-11)
        assert found.covariance[k] == pytest.approx(covariance, rel=1e-8)
        rest = (right - rows @ numbers)[: end - begin + 1]
        assert found.chi2[k] == pytest.approx(rest @ rest / (end - begin - 2), rel=1e-6)
        at = np.linspace(TIME[begin], TIME[end], 7)
        bent, rate = bend(2.0 * (at - TIME[begin]) / (2.0 * half) - 1.0, slope * half)
        place = np.column_stack([np.ones(7), (at - found.middle[k]) / half, bent])
        turn = np.column_stack([np.zeros(7), np.ones(7), rate]) / half
        angle, speed = found.some(np.array([k])).spread(at[None])
        assert angle[0] ** 2 == pytest.approx(np.einsum("ga,ab,gb->g", place, covariance, place), rel=1e-6)
        assert speed[0] ** 2 == pytest.approx(np.einsum("ga,ab,gb->g", turn, covariance, turn), rel=1e-6)


def test_third_power_tells_viscous_drag_within_flights():
    """Free rotation under -a - b·ω: ω = (ω0 + a/b)·exp(-b·t) - a/b."""
    a, b = 2.0, 0.35
    angle = np.zeros_like(TIME)
    first = np.arange(0, 12_000, 1500)
    for begin in first:
        t = TIME[begin : begin + 1500] - TIME[begin]
        angle[begin : begin + 1500] = -(5.0 + a / b) * np.expm1(-b * t) / b - a / b * t
    slope, sigma = slope_within(_track(angle, np.full(len(TIME), 1e-7)), first, first + 1499)
    assert slope == pytest.approx(b, rel=1e-4)
    assert sigma < 1e-3 * b


def test_columns_and_their_sums_are_orders_of_both_gears():
    terms = Terms(
        (("offset", 0), ("drift", 1), ("drift", 2), ("drive", 1), ("loose", 3), ("drive", 180)), np.ones(9), 0.1, 2.0
    )
    drive, loose = 17.0 * TIME, 13.0 * TIME
    x = 2.0 * (TIME - 0.1) / 2.0 - 1.0
    plain = [np.ones_like(x), x, 1.5 * x * x - 0.5, np.cos(drive), np.sin(drive), np.cos(3 * loose), np.sin(3 * loose)]
    plain = np.column_stack([*plain, np.cos(180 * drive), np.sin(180 * drive)])
    assert terms.columns(TIME, drive, loose) == pytest.approx(plain, abs=1e-10)
    numbers = np.random.default_rng(1).normal(size=(2, 9))
    assert terms.sums(numbers, TIME, drive, loose) == pytest.approx(numbers @ plain.T, abs=1e-10)


def test_cosines_and_sines_are_right_to_rounding_however_far_a_gear_has_turned():
    random = np.random.default_rng(2)
    eighths = 0.25 * np.pi * np.arange(-40, 41)
    for angle in (random.uniform(-10.0, 10.0, 10_000), random.uniform(0.0, 1e5, 10_000), eighths, np.zeros(3)):
        cosine, sine = np.zeros(len(angle)), np.zeros(len(angle))
        turned(angle, cosine, sine)
        assert np.abs(cosine - np.cos(angle)).max() < 3e-16
        assert np.abs(sine - np.sin(angle)).max() < 3e-16
