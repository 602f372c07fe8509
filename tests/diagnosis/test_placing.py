"""A pull near a flank is found over the place in the gap; noise, a drag and a ringing are no such thing."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import BINS, project_out
from gears3d.diagnosis.channels import FlickerNoise
from gears3d.diagnosis.evidence import _fine_grid
from gears3d.diagnosis.residual_patterns import gap_deceleration, gap_pattern

SPEEDS = (9.0, 14.0, 23.0)
FLIGHTS, SIGMA, GAP = 90, 2e-6, 2e-4
RADII = (0.05, 0.08)
DRAG = 40.0
"""Deceleration by the drag [rad/s²]: some 3 m/s² along the base circle."""


def _record(random, speed, pull):
    """Flights from the active flank and back, under a further deceleration of time and place in the gap."""
    first = np.sort(random.uniform(0.0, 12.0, FLIGHTS))
    lasts = random.uniform(0.006, 0.022, FLIGHTS)  # apart as far as the gap is wide, at most
    tau = np.linspace(0.0, 1.0, 1201) * lasts[:, None]
    place = 0.5 * DRAG * RADII[1] * tau * (lasts[:, None] - tau) / GAP
    slowing = pull(tau, place, lasts[:, None])
    step = lasts[:, None] / 1200.0
    rate = np.cumsum(slowing * step, axis=1)
    path = -np.cumsum(rate * step, axis=1)
    at = np.arange(BINS) * (1200 // (BINS - 1))
    time = first[:, None] + tau[:, at]
    bent = path[:, at] + SIGMA * random.normal(size=time.shape)
    loose = (RADII[0] * speed * time - GAP * place[:, at]) / RADII[1]
    flights = SimpleNamespace(time=time, loose=loose + bent, sigma=np.full(time.shape, SIGMA))
    fine, where = _fine_grid(SimpleNamespace(flights=flights))
    whole = np.linspace(0.0, 13.0, 4000)
    blows = np.array([0.0, 0.0, GAP, GAP])
    impacts = SimpleNamespace(flank=np.array([0, 0, 1, 1]), drive=np.zeros(4), loose=-blows / RADII[1])
    drive = SimpleNamespace(time=whole, angle=speed * whole)
    channels = SimpleNamespace(flights=flights, impacts=impacts, drive=drive, flicker=FlickerNoise())
    x = time - time.mean(axis=1, keepdims=True)
    rest = project_out(bent / SIGMA, (np.ones_like(x), x)).ravel()
    return SimpleNamespace(channels=channels, fine=fine, at=where, cache={}, radii=RADII), rest


def flights_under(seed, pull, speeds=SPEEDS):
    """Records of flights under a further deceleration of time, place in the gap and duration, and their residuals."""
    random = np.random.default_rng(seed)
    seen = [_record(random, speed, pull) for speed in speeds]
    return [one for one, _ in seen], [own for _, own in seen]


def _found(seed, pull=lambda tau, place, lasts: 0.0 * tau, speeds=SPEEDS):
    return next(iter(gap_pattern(*flights_under(seed, pull, speeds))), None)


@pytest.mark.parametrize("reach", [0.06, 0.15, 0.3])
def test_a_pull_within_reach_of_a_flank_is_found_there(reach):
    found = _found(3, lambda tau, place, lasts: 30.0 * (place < reach))
    assert found.name == "flight.gap"
    assert found.chance < 1e-9
    assert found.where < max(1.2 * reach, 0.1)
    if reach > 0.1:  # from nearer to the flank than that flights say little
        assert found.size == pytest.approx(30.0 * np.sqrt(reach * (1.0 - reach)), rel=0.2)


def test_every_record_tells_the_curve_by_itself_and_what_holds_back_is_above_zero():
    told = gap_deceleration(*flights_under(3, lambda tau, place, lasts: 30.0 * (place < 0.3)))
    near, far = (told.place > 0.1) & (told.place < 0.33), (told.place > 0.5) & (told.place < 0.95)
    for curve in (told.common, *told.own):
        assert curve[near].mean() - curve[far].mean() == pytest.approx(30.0, rel=0.2)


def test_a_drag_that_is_off_everywhere_and_noise_alone_have_no_place():
    for pull in (lambda tau, place, lasts: 0.0 * tau, lambda tau, place, lasts: 10.0 + 0.0 * tau):
        found = [_found(seed, pull) for seed in range(20)]
        assert not [one for one in found if one is not None and one.chance < 1e-3]


def test_what_rings_on_after_a_blow_is_no_place_though_it_fades_as_the_gear_leaves_the_flank():
    found = _found(4, lambda tau, place, lasts: 30.0 * np.cos(2.0 * np.pi * 400.0 * tau) * np.exp(-40.0 * tau))
    assert found is None or found.chance > 1e-4


def test_one_record_alone_tells_no_place():
    assert _found(3, lambda tau, place, lasts: 30.0 * (place < 0.1), SPEEDS[:1]) is None
