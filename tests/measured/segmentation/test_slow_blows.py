"""Blows so slow that what leaves the flank after them rises through the noise for many blocks."""

import numpy as np
import pytest

from tests.measured.segmentation.truth import cut, happened, seen


@pytest.mark.parametrize(
    ("swing", "seed"),
    [
        pytest.param("1.98 rpm", 62, marks=pytest.mark.slow),
        ("2.005 rpm", 62),
        pytest.param("2.02 rpm", 61, marks=pytest.mark.slow),
    ],
)
def test_slow_rebounds_across_the_gap_begin_where_the_blow_was(swing, seed):
    scenario, truth = happened(0.25, 0.0, swing, "10 s")  # the drive decelerates little more than drag does
    found = cut(scenario, seen(scenario, truth, 0.003, seed=seed))
    hits, mine = truth.impacts, found.impacts
    slow = np.flatnonzero((hits["flank"] == 1) & (np.abs(hits["velocity_m_s"]) > 1e-3))
    assert len(slow) == 30
    assert np.abs(hits["rebound_m_s"][slow]).max() < 1.5e-3
    near = [int(np.argmin(np.abs(mine["time_s"] - time))) for time in hits["time_s"][slow]]
    assert abs(found.flanks.gap[0] - scenario.rig().backlash) < 1e-6  # else nothing is asked
    off = mine["rebound_m_s"][near] / hits["rebound_m_s"][slow] - 1.0
    assert np.abs(off).max() < 0.1  # a start taken a millisecond late is off by 0.25 to 0.9
    assert np.sqrt(np.mean(off**2)) < 0.05


@pytest.mark.parametrize("seed", [61, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (62, 63))])
def test_small_bounces_are_seen_after_every_blow_of_the_same_speed(seed):
    scenario, truth = happened(0.25, 0.0, "2.085 rpm", "10 s")
    hits = truth.impacts
    alike = np.flatnonzero((hits["flank"] == 0) & (np.abs(hits["rebound_m_s"]) > 1.5e-3))
    assert np.ptp(hits["rebound_m_s"][alike]) < 1e-5
    mine = cut(scenario, seen(scenario, truth, 0.003, seed=seed)).impacts
    near = [int(np.argmin(np.abs(mine["time_s"] - time))) for time in hits["time_s"][alike]]
    assert np.isfinite(mine["rebound_m_s"][near]).sum() >= len(alike) - 1
