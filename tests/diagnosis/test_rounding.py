"""Rounding of readings to counts, which the trajectory of the gear determines."""

import numpy as np
import pytest

from gears3d.diagnosis.path_fit import effects_of, fitted, polished, state_of, unrounded
from gears3d.diagnosis.prediction import Rounding
from gears3d.diagnosis.shooting import Windows
from gears3d.measured.segmentation import path_of
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import simulate

COUNT = 2.0 * np.pi / 2e5
"""Of an encoder with 40 counts per backlash, of which four pass between two samples [rad]."""


@pytest.fixture(scope="module")
def rig():
    return load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "6 s", "run.settle": "0 s"})


def read(rig, rounded, noise=0.0):
    """Windows of a record of the rigid model, and the true displacements of their readings but for a datum [m]."""
    made = simulate(rig, "rigid")
    drive, loose = made.signals["theta_drive_rad"], made.signals["theta_loose_rad"]
    shown = loose + noise * np.random.default_rng(1).standard_normal(len(loose))
    shown = np.floor(shown / COUNT) * COUNT if rounded else shown
    known = path_of(Recording({**made.signals, "theta_loose_rad": shown}, meta=made.meta), rig, "made")
    windows = Windows(rig, [known], [rig.period], [(0.0, 0.0)])
    return windows, np.interp(windows.time, made.time, windows.radii[1] * loose - windows.radii[0] * drive)


def opened(windows):
    windows.restart((), anew=True)
    return polished(windows, fitted(windows, state_of(windows, (), windows.residuals(()))))


def test_rounding_is_removed_where_the_trajectory_determines_it(rig):
    windows, true = read(rig, rounded=True)
    before = windows.read - true
    now = opened(windows)
    after = unrounded(windows, now)
    assert after is not now
    assert np.std(windows.read - true) < 0.6 * np.std(before)
    assert windows.usual(after.rest) < 0.5 * windows.usual(now.rest)


def test_readings_without_counts_stay(rig):
    windows, _ = read(rig, rounded=False, noise=0.3 * COUNT)
    now, shown = opened(windows), windows.read.copy()
    assert unrounded(windows, now) is now
    assert np.array_equal(windows.read, shown)


def test_noise_beyond_a_count_hides_its_rounding(rig):
    windows, _ = read(rig, rounded=True, noise=1.0 * COUNT)
    now, shown = opened(windows), windows.read.copy()
    assert unrounded(windows, now) is now
    assert np.array_equal(windows.read, shown)


@pytest.mark.parametrize(("off", "part"), [(0.1, 0.03), (0.3, 0.0)])
def test_a_wrong_trajectory_stays_wrong(rig, off, part):
    """The mean over many phases of a count is that of the readings, wherever the trajectory is."""
    windows, _ = read(rig, rounded=True)
    opened(windows)
    made = windows.read - windows.missed(effects_of(()))
    step = windows.radii[1] * COUNT
    moved = windows.rounding.removed(made + off * step, windows.record[windows.window])
    kept = windows.rounding.removed(made, windows.record[windows.window])
    assert np.std(kept - windows.read) > 0.05 * step  # of means over 26 readings each
    assert np.std(moved - windows.read) >= part * step
    assert abs(np.mean(moved - kept)) < 0.1 * off * step


def test_a_gear_that_passes_whole_counts_between_samples_shows_no_rounding():
    """All readings are rounded by the same part of a count, and any trajectory near them would be confirmed."""
    time, step = np.arange(2000.0), 1.0
    place = np.zeros(2000)

    class Track:
        readings = (None, type("Reading", (), {"quantum": step, "kind": "counts"}))

    window, means = np.repeat([0, 1], 100), time.reshape(200, 10).mean(axis=1)
    halves = [(0, time[:1000], place[:1000]), (1, time[1000:], place[1000:])]
    rounding = Rounding([Track], halves, 1.0, window, means, np.zeros(200))
    assert np.array_equal(rounding.removed(np.full(200, 0.2), np.zeros(200, dtype=int)), np.zeros(200))
