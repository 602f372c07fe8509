"""Errors that blows share: their intervals hold the truth, and flanks that lie elsewhere do not slow rebounds down."""

import numpy as np
import pytest
from scipy.stats import binomtest

from gears3d.identify.impact_pairs import Pairs, mean_depths, speeds_set_right
from gears3d.identify.restitution_fit import Terms, fit, groups, repeated


def impacts(count, records=1):
    """Return impacts of four kinds on two flanks, in every record."""
    of = np.arange(count)
    ones = np.ones(count)
    return Pairs(of % records, of.astype(float), of // 4 % 2, *[ones] * 6, of % 4)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.3])
def test_intervals_hold_when_blows_of_a_kind_share_an_error(share):
    """Hundreds of blows are no better than their few kinds."""
    random = np.random.default_rng(11)
    pairs, noise = impacts(160), np.full(160, 0.01)
    columns, group = np.column_stack([np.ones(160), 0.5 * pairs.side]), groups(pairs)
    plain = np.linalg.inv(columns.T @ columns) * 0.01**2
    pulls, naive = [], []
    for _ in range(300):
        off = 0.01 * (random.normal(size=160) + share * random.normal(size=group.max() + 1)[group])
        numbers = np.linalg.lstsq(columns, off, rcond=None)[0]
        common, _ = repeated(pairs, columns, off - columns @ numbers, 0.0, noise)
        pulls.append(numbers / np.sqrt(np.diag(plain + common)))
        naive.append(numbers / np.sqrt(np.diag(plain)))
    for column in np.abs(pulls).T:
        assert binomtest(int(np.sum(column < 1.96)), len(column), 0.95, "less").pvalue > 1e-3
    assert share < 0.3 or np.std(naive) > 1.4


@pytest.mark.slow
def test_intervals_hold_when_all_blows_have_the_speed_of_a_flank_in_common():
    """Where a flank is taken to move, approaches are too fast by what rebounds are too slow."""
    random = np.random.default_rng(12)
    pulls, naive = [], []
    for _ in range(60):
        pairs = impacts(80)
        speed, moves = random.uniform(0.8, 1.2, 80), 0.01 * np.eye(2)[pairs.flank]
        moved = pairs.side * (moves @ random.normal(size=2))
        own = 0.003 * random.normal(size=(2, 80))
        seen = pairs._replace(
            approach=speed + moved + own[0],
            rebound=0.5 * speed - moved + own[1],
            approach_sigma=np.hypot(0.003, np.linalg.norm(moves, axis=1)),
            rebound_sigma=np.hypot(0.003, np.linalg.norm(moves, axis=1)),
            lowest=np.full(80, 0.01),
        )
        off = np.array([-0.5, 0.0])
        for known, told in ((moves, pulls), (None, naive)):
            found = fit(seen._replace(flank_error=known), Terms(asymmetry=True))
            told.append((found.numbers + off) / np.sqrt(np.diag(found.covariance)))
    for column in np.abs(pulls).T:
        assert binomtest(int(np.sum(column < 1.96)), len(column), 0.95, "less").pvalue > 1e-3
    assert np.std(naive) > 1.5 * np.std(pulls)


def test_records_of_their_own_share_no_error():
    """Errors of twelve records average out: what blows have in common weighs less the more records there are."""
    columns, noise = np.ones((240, 1)), np.full(240, 0.01)
    off = 0.01 * np.random.default_rng(5).normal(size=240)
    one, twelve = (repeated(impacts(240, records), columns, off, 0.0, noise)[0][0, 0] for records in (1, 12))
    assert twelve < 0.3 * one


def falls(deep, count=9, speed=0.05, rebound=0.025, pull=40.0):
    """Return flights that end on the reverse flank, thought to lie ``deep`` nearer than it does [m], and the speeds."""
    fast, slow = np.sqrt(speed**2 - 2.0 * pull * deep), np.sqrt(rebound**2 - 2.0 * pull * deep)
    end = 0.1 * np.arange(1.0, count + 1.0)
    before, after = (speed - fast) / pull, (rebound - slow) / pull
    flights = {
        "struck": np.ones(count, int),
        "blow": np.append(0, np.ones(count - 1, int)),
        "end_s": end - before,
        "start_s": np.append(0.0, end[:-1] + after),
        "end_sigma_s": np.full(count, 1e-5),
        "start_sigma_s": np.full(count, 1e-5),
        "velocity_m_s": np.full(count, fast),
        "departure_m_s": np.full(count, slow),
        "deceleration_rad_s2": np.full(count, 100.0),
        "deceleration_sigma_rad_s2": np.zeros(count),
    }
    return flights, fast, slow


def test_speeds_are_those_at_which_paths_meet():
    """Gears of 0.1 m, the loose one slowed by 100, the drive by 500 rad/s²: 40 m/s² towards the reverse flank."""
    flights, fast, slow = falls(2e-7, count=2000)
    assert mean_depths(flights)[1] == pytest.approx(2e-7, rel=1e-2)
    faster, higher = speeds_set_right(flights, lambda at: np.full(len(at), -500.0), (0.1, 0.1))
    assert fast + faster == pytest.approx(0.05, rel=1e-4)
    assert slow + higher == pytest.approx(0.025, rel=1e-3)
    assert (0.025 - slow) / 0.025 > 0.01


def test_a_depth_that_chance_explains_moves_nothing():
    flights, _, _ = falls(0.0)
    flights["end_s"] = flights["end_s"] + 1e-5 * np.resize([1.0, -1.0], 9)
    faster, higher = speeds_set_right(flights, lambda at: np.full(len(at), -500.0), (0.1, 0.1))
    assert np.abs(faster).max() < 1e-6
    assert np.abs(higher).max() < 1e-6
