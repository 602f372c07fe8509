"""The generator against the twin, kind by kind: what differs must be rounding, or shrink as the method says."""

import numpy as np
import pytest

from gears3d.verification.challenge import happen
from tests.verification.challenge import bench
from tests.verification.challenge.bench import CASES, SPRING, apart, beside, differences, rattle

FAST = ("transmission_error", "drag_power", "mesh_drag", "restitution_speed", "backlash_variation")


def agree(name):
    kind = name.split(",")[0]
    ours, theirs = beside(rattle([{"kind": kind, **CASES[name]}]))
    errors = differences(ours, theirs)
    assert len(ours.impacts["time_s"]) > 50
    assert errors["time_s"] < 1e-11
    assert errors["velocity_m_s"] < 2e-11
    assert errors["rebound_m_s"] < 2e-11
    assert errors["impulse_N_s"] < 1e-10
    assert apart(ours, theirs) < 2e-13


@pytest.mark.parametrize("name", FAST)
def test_every_impact_is_the_twins(name):
    agree(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if name not in FAST])
def test_every_impact_is_the_twins_for_all_kinds(name):
    agree(name)


@pytest.mark.slow
@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_an_eccentric_gear_differs_by_the_square_of_its_offset(gear):
    found = []
    for offset in ("60 um", "30 um"):
        effect = {"kind": "eccentricity", "offset": offset, "gear": gear, "phase": "40 deg"}
        found.append(apart(*beside(rattle([effect]))))
    assert found[0] < 10 * (60e-6) ** 2 / 0.315  # the twin's law is of first order in the offset
    assert found[0] / found[1] == pytest.approx(4.0, rel=0.35)


@pytest.mark.slow
@pytest.mark.parametrize(
    "tooth", [{"tooth": 7}, {"tooth": 23, "flank": "reverse"}, {"tooth": 38, "gear": "loose", "flank": "reverse"}]
)
def test_a_tooth_out_of_step_meets_as_on_rolled_surfaces(tooth):
    ours, theirs = beside(
        rattle([{"kind": "pitch_error", "offset": "-20 um" if "flank" in tooth else "20 um", **tooth}])
    )
    plain = happen(rattle([]))
    errors = differences(ours, theirs)
    assert errors["time_s"] < 1e-7
    assert errors["velocity_m_s"] < 1e-7
    assert apart(ours, theirs) < 1e-9  # the twin fits polynomials to what it rolled
    assert apart(ours, plain) > 1e-6


@pytest.mark.parametrize(("play", "step"), [("0 rad", 2e-5), ("2e-4 rad", 2e-6)])
def test_a_body_on_a_spring_agrees(play, step):
    """At the ends of its play the force has a kink, over which fixed steps are of lower order."""
    body = {"kind": "carried_inertia", "inertia": "0.02 kg m^2", "stiffness": "400 N m/rad", "damping": "0.1 N m s/rad"}
    ours, theirs = beside(rattle([{**body, "play": play}], "0.5 s"), step=step)
    assert apart(ours, theirs) < 1e-9
    assert apart(ours, happen(rattle([], "0.5 s"))) > 1e-5


def test_stick_slip_of_straight_lines_agrees_with_its_harmonics():
    """Contact that ends at the rounded corner of a slip ends a little earlier or later."""
    slips = {"kind": "drag_stick_slip", "amplitude": "0.06 N m", "angle": "37 deg", "phase": "50 deg"}
    ours, theirs = beside(rattle([slips]))
    moved = apart(ours, happen(rattle([])))
    assert moved > 2e-5
    assert apart(ours, theirs) < 0.02 * moved


@pytest.mark.slow
def test_teeth_that_yield_agree_and_converge():
    errors = []
    for step in (4e-5, 2e-5, 1e-5):
        ours, theirs = beside(rattle([SPRING], **{"run.output_rate": "12500 Hz"}), step=step)
        errors.append(apart(ours, theirs))
    assert errors[1] < 1e-10
    assert errors[2] < errors[0] / 4.0  # a kink where the force lets go: at least second order


@pytest.mark.slow
@pytest.mark.parametrize("more", [{"kind": "mesh_friction", "coefficient": 0.2}])
def test_friction_alters_the_motion_of_teeth_that_yield(more):
    ours, theirs = beside(rattle([SPRING, more]))
    assert apart(ours, theirs) < 1e-10
    assert apart(ours, happen(rattle([SPRING]))) > 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("viscosity", ["0.05 Pa s", "0.5 Pa s"])
def test_oil_films_agree_and_converge(viscosity):
    scenario = rattle([{"kind": "oil_film", "viscosity": viscosity}], "1 s", **{"run.output_rate": "12500 Hz"})
    errors = [apart(*beside(scenario, step=step)) for step in (2e-5, 1e-5)]
    assert errors[0] < 1e-9
    assert errors[1] < errors[0] / 2.0 or errors[1] < 1e-13


def test_the_method_is_of_fourth_order():
    effects = [
        {"kind": "drag_power", "coefficient": "0.02 N m", "exponent": 1.7},
        {"kind": "drag_position", "amplitude": "0.05 N m", "order": 9, "phase": "10 deg"},
    ]
    scenario = rattle(effects, "0.5 s", **{"run.output_rate": "125 Hz"})
    exact = happen(scenario, step=2.5e-4)
    errors = [apart(happen(scenario, step=step), exact) for step in (8e-3, 4e-3, 2e-3)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.5).all(), (errors, orders)


@pytest.mark.slow
def test_scatter_has_the_deviation_that_was_asked_for():
    effect = {"kind": "restitution_scatter", "standard_deviation": 0.08}
    ours, theirs = beside(rattle([effect], "60 s"))
    shares = []
    for recording in (ours, theirs):
        v, back = (np.abs(recording.impacts[name]) for name in ("velocity_m_s", "rebound_m_s"))
        shares.append((back / v)[v > 5e-3])
    count = min(map(len, shares))
    assert count > 500
    for share in shares:
        assert share.std() == pytest.approx(0.08, abs=4 * 0.08 / np.sqrt(2 * count))
        assert share.mean() == pytest.approx(0.3, abs=4 * 0.08 / np.sqrt(count))


@pytest.mark.slow
def test_helical_gears_and_other_ratios_agree():
    effect = {"kind": "transmission_error", "order": 2, "amplitude": "10 um", "gear": "loose", "phase": "30 deg"}
    base = "scenarios/kadmiri-2012/fig13-100rpm.toml"
    ours, theirs = beside(rattle([effect], "0.5 s", base=base, **{"drag.torque": "0.2 N m"}))
    assert len(ours.impacts["time_s"]) > 50
    assert differences(ours, theirs)["time_s"] < 1e-9


def test_a_free_start_is_amid_the_gap():
    ours = happen(rattle([], "0.1 s", **{"start.state": "free"}))
    gap = bench.rattle([]).pair().backlash
    assert ours.signals["displacement_m"][0] == pytest.approx(gap / 2)
