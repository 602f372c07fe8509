"""The drive's motion: what is averaged to quieten counts must not flatten the motion itself."""

import numpy as np
import pytest

from gears3d.measured.segmentation import read_encoder, steady


@pytest.mark.parametrize("counts", [8192, 400_000])
def test_a_swinging_drive_is_not_flattened_by_means(counts):
    """Means over 0.4 ms of a swing lie beside the path by half its acceleration times their variance."""
    time = np.arange(0.0, 0.8, 1e-6 if counts == 8192 else 2e-5)
    swing = 2.0 * np.pi * 30.0
    angle = 10.0 * time + 3.0 / swing * np.sin(swing * time)
    count = 2.0 * np.pi / counts
    curve = steady(read_encoder(time, np.floor(angle / count) * count)).curve
    some = np.arange(0.05, 0.75, 1e-4)
    off = curve(some) - 10.0 * some - 3.0 / swing * np.sin(swing * some)
    in_step = 2.0 * np.mean((off - off.mean()) * np.sin(swing * some))
    beside = 0.5 * 3.0 * swing * (0.4e-3) ** 2 / 12.0
    assert abs(in_step) < 0.1 * beside


@pytest.mark.parametrize("noise", [1e-4, 3e-4])
def test_a_fluctuation_as_fast_as_a_spline_has_knots_is_no_noise(noise):
    time = np.arange(0.0, 2.0, 1.0 / 24_000.0)
    turn = 2.0 * np.pi * 410.0  # 58 readings in a period
    angle = 200.0 * time - 2.5e-4 * np.cos(turn * time)
    motion = steady(read_encoder(time, angle + np.random.default_rng(4).normal(0.0, noise, len(time))))
    some = np.arange(0.05, 1.95, 1e-4)
    off = motion.curve(some, 1) - 200.0 - 2.5e-4 * turn * np.sin(turn * some)
    assert np.std(off) < 0.03 * 2.5e-4 * turn
    assert np.std(off) < 3.0 * motion.speed_sigma
    assert motion.rest < 1.1


def test_readings_repeated_now_and_then_are_left_out():
    time = np.arange(0.0, 1.0, 1e-4)
    angle = np.floor((60.0 * time + 0.05 * np.sin(40.0 * time)) / 1e-5) * 1e-5
    held = np.arange(9, len(time), 9)
    read = angle.copy()
    read[held] = read[held - 1]
    known = read_encoder(time, read)
    assert len(known.time) == len(time) - len(held)
    assert not np.isin(time[held], known.time).any()
    assert len(read_encoder(time, angle).time) == len(time)
    curve = steady(known).curve(time[100:-100])
    assert np.abs(curve - angle[100:-100]).max() < 2e-5


def test_a_slow_counter_keeps_its_edges():
    time = np.arange(0.0, 1.0, 1e-4)
    assert read_encoder(time, np.floor(0.3 * time**1.1 / 1e-3) * 1e-3).kind == "edges"
