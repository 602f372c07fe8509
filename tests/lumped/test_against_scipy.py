"""The kernel against the second model in oracle.py: impacts to 1e-8 of a period over ten periods."""

import numpy as np
import pytest

from gears3d.effects import Flank, Gear, Rig, flank_harmonic, impact_slope, torque_linear
from tests.lumped.oracle import RPM, Oracle
from tests.lumped.rig import model, run

ERROR = {
    "drive": [(0, 0, 1, 20e-6, 0.7), (0, 1, 1, -20e-6, 0.7)],
    "loose": [(1, 0, 3, 6e-6, 0.3), (1, 1, 2, 4e-6, 1.0), (0, 0, 2, 5e-6, 0.0)],
}
CASES = {
    "plain": {},
    "error": {"deviations": ERROR["drive"]},
    "both_gears": {"deviations": ERROR["loose"]},
    "viscous": {"viscous": 0.02},
    "slope": {"slope": -4.0},
    "all": {"deviations": ERROR["drive"] + ERROR["loose"], "viscous": 0.02, "slope": -4.0},
}


def kernel(oracle, duration):
    rows = [flank_harmonic(Gear(g), Flank(f), n, a, p) for g, f, n, a, p in oracle.deviations]
    if oracle.viscous:
        rows.append(torque_linear(oracle.viscous))
    if oracle.slope:
        rows.append(impact_slope(oracle.slope))
    rig = Rig(
        oracle.rb1, oracle.rb2, oracle.inertia, oracle.drag, oracle.backlash, oracle.e, oracle.mean, 90, 90
    )  # fmt: skip
    m = model(rig, [(oracle.amplitude, oracle.frequency, 0.0)], rows, oracle.stick)
    return run(m, duration).impacts


def assert_same(oracle, periods):
    duration = periods / oracle.frequency
    theirs, ours = oracle.run(duration), kernel(oracle, duration)
    assert len(theirs) >= 2 * periods
    assert np.array_equal(ours[:, 1], theirs[:, 1])
    assert np.abs(ours[:, 0] - theirs[:, 0]).max() * oracle.frequency < 1e-8
    assert np.allclose(ours[:, 2], theirs[:, 2], rtol=1e-6, atol=1e-10)
    assert np.allclose(ours[:, 3], theirs[:, 3], rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize(("case", "periods"), [("plain", 2), ("slope", 2), ("all", 2)])
def test_periods(case, periods):
    assert_same(Oracle(20 * RPM, 3.0, 0.5, **CASES[case]), periods)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("e", [0.0, 0.3, 0.5, 0.7])
def test_ten_periods(case, e):
    assert_same(Oracle(20 * RPM, 3.0, e, **CASES[case]), periods=10)


@pytest.mark.slow
def test_unequal_gears_and_another_point_of_work():
    assert_same(Oracle(9 * RPM, 11.0, 0.6, backlash=120e-6, rb1=0.0251, rb2=0.0513, inertia=9.9e-4, drag=0.01), 10)
