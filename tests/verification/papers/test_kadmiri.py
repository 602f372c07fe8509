"""Kadmiri et al. 2012: every row as recorded; the tools of the rows against closed forms."""

from math import pi

import numpy as np
import pytest

from gears3d.verification.papers import Bench, hold, paper
from gears3d.verification.papers.kadmiri_2012 import impacts, rundowns, table1
from gears3d.verification.papers.kadmiri_2012.rattle import at_excitation


@pytest.fixture(scope="module")
def bench():
    return Bench()


@pytest.mark.slow
@pytest.mark.parametrize("claim", paper("kadmiri-2012").claims, ids=lambda c: f"{c.figure} {c.quantity}"[:60])
def test_every_row_has_the_verdict_on_record(claim, bench):
    result = hold(claim, bench)
    assert result.verdict == claim.recorded, result.computed


def test_rigid_flanks_part_at_one_wherever_the_loose_gear_keeps_turning(bench):
    assert table1.threshold(bench, 1000) == pytest.approx(1.0, abs=1e-4)


def test_the_squeezed_film_takes_one_speed_off_every_fall(bench):
    # m*dv = Cs(h)*dh: dv = 2*(3*pi*L*eta/sqrt(2))*(r/h)^1.5*h/m between 50 and 1 um; then the spring, and no film back
    from gears3d.laws import contact_length, equivalent_radius, squeeze

    rig = bench.scenario("base/kadmiri-2012.toml").rig()
    length = contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    radius = equivalent_radius(
        rig.base_radius_drive, rig.base_radius_loose, rig.working_pressure_angle, rig.base_helix_angle
    )
    mass = rig.inertia / rig.base_radius_loose**2
    taken = 2 * sum(sign * float(squeeze(h, length, 0.03, radius)) * h for sign, h in ((1, 1e-6), (-1, 50e-6))) / mass
    hard = 20.0  # so fast that the film's share on the roughness, which the spring stops, does not count
    found = impacts.rebound(bench, hard, 0.0) - impacts.rebound(bench, hard, 0.03)
    assert found * hard >= taken  # the film acts on in the spring's travel
    assert impacts.rebound(bench, 0.2, 0.0) == pytest.approx(1.0, abs=1e-4)


def test_colder_oil_is_thicker_and_drags_more():
    assert rundowns.viscosity(30.0) > rundowns.viscosity(40.0) > 0.03
    cold, warm = (rundowns.added(3, temperature) for temperature in (30.0, 50.0))
    for one, other in zip(cold[1:], warm[1:], strict=True):
        assert float(one["coefficient"].split()[0]) > float(other["coefficient"].split()[0])


def test_settings_reach_the_excitation_asked_for(bench):
    scenario = bench.scenario("kadmiri-2012/fig12-1000rpm.toml", at_excitation(bench, 500, 2.0))
    rig, swing = scenario.rig(), scenario.motion.harmonics[0]
    inertial = rig.inertia * swing.amplitude * rig.base_radius_drive / rig.base_radius_loose * 2 * pi * swing.frequency
    assert inertial / rig.drag_torque == pytest.approx(2.0, rel=1e-5)
    assert swing.frequency == pytest.approx(2 * 500 / 60)


def test_impacts_on_a_stiff_flank_last_until_spring_and_damper_stop_pushing(bench):
    found = impacts.durations(bench, stiffness=impacts.STEEL)
    ratio, natural = 0.28, np.sqrt(impacts.STEEL / 0.38)
    damped = np.sqrt(1 - ratio**2)  # tan(damped*natural*t) = -2*ratio*damped/(1 - 2*ratio^2)
    ends = (pi - np.arctan(2 * ratio * damped / (1 - 2 * ratio**2))) / (damped * natural)
    assert found.mean() == pytest.approx(1e3 * ends, abs=5e-3)  # one sample of 200 kHz
