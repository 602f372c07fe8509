"""Ottewill et al. 2010: the rigid model against the paper's closed-form flight, scenarios against their script."""

import runpy
from math import pi
from pathlib import Path

import numpy as np
import pytest

from gears3d.laws import ottewill
from gears3d.verification.papers import Bench
from gears3d.verification.papers.measures.tooth_errors import ERRORS, disconnection, error_function, shift

FOLDER = Path(__file__).resolve().parents[3] / "scenarios/ottewill-2010"


@pytest.fixture(scope="module")
def bench():
    return Bench()


def flown(case, amplitude, phase, damping=2.3, contact=4.2, fine=200_000):
    """Disconnection after the first loss of contact: θ2 flies as θ2' ∝ e^(−δτ) whatever the error is."""
    error = error_function(case)
    absolute = phase + error.phase[0]
    tau = np.linspace(0.0, 2.0, fine)
    push = ottewill.forcing(tau, amplitude, absolute, contact, error)
    steady = np.flatnonzero(push[fine // 8 :] < 0)[0] + fine // 8
    since = tau[steady:] - tau[steady]
    angle = ottewill.drive(tau[steady:], amplitude, absolute)
    carried = angle - error.at(angle)
    speed = ottewill.drive(tau[steady], amplitude, absolute, 1) * (1 - error.at(angle[0], 1))
    gap = carried[0] + speed / damping * (1 - np.exp(-damping * since)) - carried
    back = np.flatnonzero(gap[1:] < 0)[0] + 1
    return min(gap[:back].max(), 2 * 1.63e-2)


@pytest.mark.parametrize("phase", [2.60, 5.14, 0.25])
def test_the_twin_flies_as_the_dimensionless_form(bench, phase):
    found = disconnection(bench.case("ottewill-2010/case-i"), 0.43, [phase])[0]
    assert found == pytest.approx(flown("i", 0.43, phase), rel=1e-3)


def test_assumed_errors_are_as_large_as_printed():
    angle = np.linspace(0.0, 2 * pi, 7200, endpoint=False)
    for case, (peak, *_) in ERRORS.items():
        error = error_function(case)
        assert abs(error.at(angle)).max() == pytest.approx(peak, rel=1e-9)
        assert error.amplitude.argmax() == 0
        assert len(set(error.order.tolist())) == 21


def test_scenarios_are_those_that_the_script_writes():
    script = runpy.run_path(str(FOLDER / "synthesise.py"))
    for case in ERRORS:
        assert (FOLDER / f"case-{case}.toml").read_text() == script["text"](case)


@pytest.mark.parametrize(("case", "contact"), [("i", 4.2), ("ii", 4.2), ("iii", 3.7), ("iv", 4.2)])
def test_scenarios_are_the_dimensionless_form_in_si(bench, case, contact):
    scenario = bench.scenario(f"ottewill-2010/case-{case}.toml")
    rig = scenario.rig()
    expected = ottewill.dimensional(2.3, contact, 1.63e-2, rig.inertia, 1.0, rig.base_radius_loose)
    drags = {each.kind: each.coefficient for each in scenario.effects if each.kind != "transmission_error"}
    assert drags == pytest.approx({"drag_viscous": expected.drag_viscous, "mesh_drag": expected.mesh_drag})
    assert rig.backlash == pytest.approx(expected.backlash, rel=5e-4)
    assert scenario.motion.mean == pytest.approx(2 * pi)


def test_scenarios_carry_the_error_as_the_flank_of_the_papers_sign(bench):
    scenario = bench.scenario("ottewill-2010/case-ii.toml")
    angle = np.linspace(0.0, 6.0, 50)
    waves = [each for each in scenario.effects if each.kind == "transmission_error"]
    flank = sum(each.amplitude * np.cos(each.order * angle + each.phase) for each in waves)
    expected = -scenario.rig().base_radius_loose * error_function("ii").at(angle)
    assert flank == pytest.approx(expected, abs=2e-9)


def test_a_contour_shifted_by_half_a_turn_is_seen():
    bump = np.exp(-((np.arange(30) - 7.0) ** 2) / 8)[None, :] * np.ones((8, 1))
    assert shift(bump, np.roll(bump, 15, axis=1)) == pytest.approx(pi)
    assert shift(bump, np.roll(bump, -5, axis=1)) == pytest.approx(pi / 3)
    assert shift(bump, bump) == 0.0
