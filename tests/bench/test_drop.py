"""Drops give the law of restitution back, and arrive as fast as they are asked to."""

import numpy as np
import pytest

from gears3d.bench import drops
from gears3d.scenario import load

LAW = [
    {"kind": "restitution_speed", "slope": "-2 s/m"},
    {"kind": "restitution_asymmetry", "asymmetry": 0.1},
]
RIG = "scenarios/base/rigaud-2020.toml"


def test_the_law_of_both_flanks_comes_back():
    scenario = load(RIG, {"effect": LAW})
    found = drops(scenario, [0.005, 0.03, 0.08], repeat=2)
    for flank, sign in (("active", 1.0), ("reverse", -1.0)):
        at_rest, slope, spread = found.laws[flank]
        assert at_rest == pytest.approx(0.3 + 0.05 * sign, abs=1e-9)
        assert slope == pytest.approx(-2.0, abs=1e-8)
        assert spread < 1e-9
    assert np.abs(found.table["velocity_m_s"]) == pytest.approx(found.table["asked_m_s"], rel=1e-4)
    rig = scenario.rig()
    # what a flank gives back is impulse over mass
    gained = found.table["rebound_m_s"] - found.table["velocity_m_s"]
    mass = rig.inertia / rig.base_radius_loose**2
    assert found.table["impulse_N_s"] == pytest.approx(mass * gained, rel=1e-9)


def test_a_standing_drive_and_scatter():
    scatter = {"kind": "restitution_scatter", "standard_deviation": 0.05}
    found = drops(load(RIG, {"effect": [scatter], "motion.mean": "0 rpm", "run.settle": "0 s"}), [0.05], repeat=60)
    for flank in ("active", "reverse"):
        at_rest, slope, spread = found.laws[flank]
        assert slope == 0.0
        assert at_rest == pytest.approx(0.3, abs=4 * 0.05 / 60**0.5)
        assert spread == pytest.approx(0.05, rel=0.4)


def test_what_sticks_is_counted_and_not_in_the_law():
    told = drops(load(RIG), [0.0002, 0.01, 0.02], repeat=1).to_dict()
    assert told["stuck"] == 1  # from the reverse flank drag pulls it off again
    assert told["active"]["restitution_at_rest"] == pytest.approx(0.3, abs=1e-9)
