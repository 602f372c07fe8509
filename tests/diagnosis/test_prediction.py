"""What effects add to the channels: against rolled surfaces, closed forms and the twin's own records."""

import numpy as np
import pytest

from gears3d.diagnosis import project_out
from gears3d.diagnosis.prediction import deviation, reading_error, restitution, torque
from gears3d.effects import catalogue
from gears3d.gears import Eccentricity, Gear, HarmonicDeviation, Pair, ToothDeviation, quasi_static
from gears3d.scenario import load

PAIR = Pair.from_backlash(Gear(3.5e-3, 19), Gear(3.5e-3, 37), 250e-6)
RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"gears.drive.teeth": 19, "gears.loose.teeth": 37}).rig()


def places(effect, theta):
    """Return what the effect's rows do to both flanks over the drive's angle."""
    across = RIG.backlash / RIG.base_radius_loose  # that the loose gear is ahead on the reverse flank
    return [
        deviation(effect.rows(RIG), PAIR, theta, theta * 19 / 37 + flank * across, np.full(len(theta), flank))
        for flank in (0, 1)
    ]


def rolled(*given, mounting=()):
    theta = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)
    pair = PAIR.with_deviations(*given) if given else PAIR.with_mounting(*mounting)
    found = quasi_static(pair, theta)
    return theta, found.phi_active, found.phi_reverse


@pytest.mark.parametrize("order", [1, 5])
def test_a_wave_moves_both_flanks_as_rolled_surfaces_do(order):
    waves = (
        HarmonicDeviation("drive", "active", order, 1e-6, 0.7),
        HarmonicDeviation("drive", "reverse", order, -1e-6, 0.7),
    )
    theta, active, reverse = rolled(*waves)
    effect = catalogue()["transmission_error"](amplitude=1e-6, order=order, phase=0.7)
    for own, true in zip(places(effect, theta), (active, reverse), strict=True):
        assert np.abs(own - true).max() < 1e-9


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_an_eccentric_gear_moves_flanks_as_rolled_surfaces_do_to_first_order(gear):
    for offset in (1e-6, 4e-6):
        theta, active, reverse = rolled(mounting=(Eccentricity(gear, offset, 0.4),))
        effect = catalogue()["eccentricity"](offset=offset, gear=gear, phase=0.4)
        for own, true in zip(places(effect, theta), (active, reverse), strict=True):
            assert np.abs(own - true).max() < 40.0 * offset**2 + 1e-10


@pytest.mark.parametrize("size", [2e-5, -2e-5])
@pytest.mark.parametrize("flank", ["active", "reverse"])
def test_a_single_tooth_carries_where_rolled_surfaces_say(size, flank):
    theta, *true = rolled(ToothDeviation("drive", flank, 4, size if flank == "active" else -size))
    effect = catalogue()["pitch_error"](offset=size, tooth=4, flank=flank)
    for own, place in zip(places(effect, theta), true, strict=True):
        wrong = np.abs(own - place) > 1e-9
        assert np.mean(wrong) < 0.02  # but for the two places where the tooth comes and goes
        assert np.abs(own).max() == pytest.approx(np.abs(place).max(), abs=1e-9)


def test_torques_are_those_of_their_definitions():
    speed, angle, time = np.array([2.0, 5.0]), np.array([0.3, 1.0]), np.array([0.0, 4.0])
    kinds = catalogue()
    made = {
        kinds["drag_viscous"](coefficient=0.1): 0.1 * speed,
        kinds["drag_power"](coefficient=0.2, exponent=1.5): 0.2 * speed**1.5,
        kinds["drag_differential"](coefficient=0.1, shaft_speed=3.0): 0.1 * (speed - 3.0),
        kinds["drag_position"](amplitude=0.3, order=2, phase=0.1): 0.3 * np.cos(2 * angle + 0.1),
        kinds["drag_drift"](relative_change=0.5, time_constant=2.0): 0.5 * RIG.drag_torque * (1 - np.exp(-time / 2.0)),
        kinds["mesh_drag"](coefficient=0.4): 0.0 * speed,
    }
    for effect, true in made.items():
        assert torque(effect.rows(RIG), speed, angle, time) == pytest.approx(true, abs=1e-15)
    contact = torque(kinds["mesh_drag"](coefficient=0.4).rows(RIG), speed, angle, time, np.array([0, 1]))
    assert contact == pytest.approx(0.4 * speed)


def test_sensors_read_what_the_effects_themselves_make_of_angles():
    time = np.linspace(0.0, 1.0, 2001)
    angle = 3.0 * time
    kinds = catalogue()
    for effect in (
        kinds["encoder_eccentricity"](amplitude=1e-3, order=2, phase=0.3),
        kinds["encoder_skew"](delay=1e-3),
    ):
        read = effect.observe({"drive": angle, "loose": angle}, time)["loose"]
        assert reading_error([effect], "loose", angle, np.full(2001, 3.0), true=True) == pytest.approx(
            read - angle, abs=1e-12
        )
        assert not reading_error([effect], "drive", angle, np.full(2001, 3.0)).any()


def test_restitution_adds_up_and_stays_within_bounds():
    kinds = catalogue()
    effects = (kinds["restitution_offset"](offset=0.1), kinds["restitution_asymmetry"](asymmetry=0.2),
               kinds["restitution_speed"](slope=-2.0))  # fmt: skip
    rows = [row for effect in effects for row in effect.rows(RIG)]
    found = restitution(rows, 0.3, np.array([0.05, -0.05, 10.0]), np.array([0, 1, 0]))
    assert found.tolist() == pytest.approx([0.4, 0.2, 0.0])


def test_nuisances_are_taken_out_whatever_their_size():
    random = np.random.default_rng(1)
    free = (np.ones((3, 50)), np.tile(np.arange(50.0), (3, 1)))
    rest = random.normal(size=(3, 50))
    with_them = rest + 1e6 * free[0] - 1e4 * free[1]
    assert project_out(with_them, free) == pytest.approx(project_out(rest, free), abs=1e-7)
    assert np.abs(project_out(rest, free) @ free[1][0]).max() < 1e-9


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_errors_of_encoders_are_at_the_angle_of_the_gear_behind_the_reading(gear):
    """At the angle that is read, they were off by n·A²/2: 7 sigma in the drive, and a motion of it was invented."""
    kind, true = catalogue()["encoder_eccentricity"], np.linspace(0.0, 20.0, 1000)
    errors = [kind(amplitude=2.3e-3, order=4, phase=0.5, gear=gear), kind(amplitude=1e-3, phase=2.0, gear=gear)]
    wrong = sum(one.observe({gear: true}, true)[gear] - true for one in errors)
    at_gear = reading_error(errors, gear, true, np.ones_like(true), true=True)
    assert at_gear == pytest.approx(wrong, abs=1e-12)
    assert reading_error(errors, gear, true + wrong, np.ones_like(true)) == pytest.approx(wrong, abs=1e-8)
    assert np.max(np.abs(reading_error(errors, gear, true + wrong, np.ones_like(true), true=True) - wrong)) > 1e-5
