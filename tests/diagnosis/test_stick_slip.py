"""Stick-slip of the loose gear: found along the path from the order that flights repeat by, and no sine."""

import numpy as np
import pytest

from gears3d.diagnosis import diagnose
from gears3d.diagnosis.causes import Candidate, begin
from gears3d.diagnosis.diagnosis import SLIP_PHASES
from gears3d.diagnosis.path_fit import effects_of
from gears3d.diagnosis.path_search import path_search
from gears3d.diagnosis.residual_patterns import Structure
from gears3d.diagnosis.verdict import is_sawtooth, is_sine, slip_angles
from gears3d.effects import catalogue
from gears3d.measured.checks import admit_all
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan
from tests.diagnosis.test_shooting import RIG, low_of, shot

ANGLE = 0.43


@pytest.fixture(scope="module")
def rig():
    return load(RIG, {"run.duration": "6 s", "run.settle": "0 s"})


def searched(rig, effect, tried):
    """Windows of a rig with an effect, and the causes that a search for torques over the angle finds in them."""
    windows, _ = shot(rig, [effect])
    plain = [one for one in low_of(rig, windows) if one.kind in ("drag_coulomb", "drag_position")]
    slips = [
        Candidate("drag_stick_slip", {"angle": tried, "phase": one}, "amplitude", rig.rig().drag_torque, False, ())
        for one in SLIP_PHASES
    ]
    return windows, path_search(windows, [*plain, *slips]).causes


def test_it_is_found_from_an_angle_that_is_slightly_wrong(rig):
    true = catalogue()["drag_stick_slip"](amplitude=0.02, angle=ANGLE, phase=0.7)
    windows, causes = searched(rig, true, 1.004 * ANGLE)
    assert [one.candidate.kind for one in causes] == ["drag_stick_slip"]
    found = causes[0].effect
    assert found.amplitude == pytest.approx(true.amplitude, rel=2e-3)
    assert found.angle == pytest.approx(true.angle, rel=1e-5)
    assert np.angle(np.exp(1j * (found.phase - true.phase))) == pytest.approx(0.0, abs=2e-3)
    assert is_sawtooth(windows, causes)


ORDER = 15
"""Of a sine; it is not searched."""


def sine(rig):
    """Windows of a rig with a torque that is a sine over the angle of the loose gear."""
    return shot(rig, [catalogue()["drag_position"](amplitude=0.02, order=ORDER, phase=0.7)])[0]


def test_a_sine_over_the_angle_is_no_stick_slip(rig):
    """One whose first harmonic is the sine fits worse than the sine alone."""
    windows, shape = sine(rig), {"angle": 2.0 * np.pi / ORDER, "phase": 0.7 - 0.5 * np.pi}
    slip = begin(Candidate("drag_stick_slip", shape, "amplitude", 1.0, False, ()), np.array([0.01 * np.pi]))
    windows.restart(effects_of([slip]), anew=True)
    assert not is_sawtooth(windows, [slip])


def test_a_sine_over_the_angle_is_no_second_body(rig):
    """Its natural frequency is that of the sine at mean speed."""
    windows, own = sine(rig), rig.rig().inertia
    stiffness = (ORDER * windows.pivot) ** 2 / (1.0 / own + 1.0 / (0.01 * own))
    law = Candidate("carried_inertia", {"stiffness": stiffness, "damping": 0.0, "play": 0.0}, "inertia", own, False, ())
    assert is_sine(windows, [begin(law, np.array([0.01]))])


@pytest.mark.parametrize(("name", "order"), [("flight.angle_loose", 5.0), ("flight.angle_drive", 5.0 * 17 / 43)])
def test_the_angle_between_slips_is_that_over_which_flights_repeat(name, order):
    pattern = Structure(name, 100.0, 1e-9, 0.1, "rad/s^2", order)
    rig = load("scenarios/base/helical-17-43.toml")
    assert slip_angles([pattern], rig) == pytest.approx([2.0 * np.pi / 5.0])
    assert slip_angles([pattern._replace(name="flight.speed")], rig) == []


@pytest.mark.slow
def test_a_hidden_one_is_named_with_intervals(tmp_path):
    drawn = plan(5, ("drag_stick_slip",), size=0.2, records=3, duration=5.0, noise=0.003)
    hide(drawn, tmp_path)
    bench = load(tmp_path / "rig.toml")
    found = diagnose(admit_all([tmp_path / "record.toml"], bench), bench)
    assert found.verdict == "explained"
    assert [one.kind for one in found.causes] == ["drag_stick_slip"]
    true, told = drawn.told()["effects"][0], found.causes[0].parameters
    assert told["amplitude"].value == pytest.approx(true["amplitude"], rel=0.01)
    assert all(told[name].low < true[name] < told[name].high for name in ("amplitude", "angle", "phase"))
    assert found.to_dict()["heldout"]["gain"] > 0.8
