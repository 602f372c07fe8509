"""Impacts are kinks of a path, tops of flights are none."""

import numpy as np

from gears3d.measured.segmentation.displacement import Blocks, kinks

NOISE = 5e-7


def blocks(place):
    time = 1e-4 * np.arange(len(place))
    noisy = place + np.random.default_rng(3).normal(0.0, NOISE, len(place))
    return Blocks(time, 100.0 * time, 100.0 * time, noisy, NOISE, 0.0, 1, 1e-4)


def test_the_top_of_a_flight_is_no_kink_and_its_landing_is():
    x = np.clip(np.arange(90) / 40.0, 0.0, 1.0)
    place = np.tile(200e-6 * x**2 * (1.0 - x), 20)  # leaves its flank tangentially, lands at 40 of 90 blocks
    found = kinks(blocks(place))
    where = np.mod(found.at, 90)
    assert np.count_nonzero(np.abs(where - 40) <= 2) == 20
    assert not np.any((where > 10) & (where < 36))  # the top is at 27
    assert np.all(found.jump > 0.0)


def test_impacts_on_two_flanks_near_each_other_are_both_found():
    place = 42e-6 * np.abs(np.mod(np.arange(3000) / 60.0, 2.0) - 1.0)  # 60 blocks from flank to flank
    found = kinks(blocks(place))
    inner = (found.at > 100) & (found.at < 2900)
    up = found.jump[inner] > 0.0
    assert abs(np.count_nonzero(up) - np.count_nonzero(~up)) <= 1
    assert np.count_nonzero(inner) == 47
    assert np.abs(np.where(up, found.place[inner], found.place[inner] - 42e-6)).max() < 1e-6
