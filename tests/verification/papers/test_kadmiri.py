"""Kadmiri et al. 2012: the measures of its rows against closed forms."""

from math import pi

import numpy as np
import pytest

from gears3d.verification.papers import Bench
from gears3d.verification.papers.measures import oil, responses

STEEL = 2.5e8  # of a steel mesh, 15.7 N/(mm µm) on 16 mm [N/m]


@pytest.fixture(scope="module")
def bench():
    return Bench()


def test_rigid_flanks_lose_contact_at_one_wherever_the_loose_gear_keeps_turning(bench):
    assert responses.threshold_excitation(bench.case("kadmiri-2012/table1-1000rpm")) == pytest.approx(1.0, abs=1e-4)


def test_the_squeezed_film_takes_one_speed_off_every_fall(bench):
    # m*dv = Cs(h)*dh: dv = 2*(3*pi*L*eta/sqrt(2))*(r/h)^1.5*h/m between 50 and 1 um; then the spring, and no film back
    from gears3d.laws import contact_length, equivalent_radius, squeeze

    case = bench.case("base/kadmiri-2012")
    rig = case.rig
    length = contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    radius = equivalent_radius(
        rig.base_radius_drive, rig.base_radius_loose, rig.working_pressure_angle, rig.base_helix_angle
    )
    mass = rig.inertia / rig.base_radius_loose**2
    taken = 2 * sum(sign * float(squeeze(h, length, 0.03, radius)) * h for sign, h in ((1, 1e-6), (-1, 50e-6))) / mass
    hard = 20.0  # so fast that the film's share on the roughness, which the spring stops, does not count
    found = oil.film_rebound(case, hard, 0.0) - oil.film_rebound(case, hard, 0.03)
    assert found * hard >= taken  # the film acts on in the spring's travel
    assert oil.film_rebound(case, 0.2, 0.0) == pytest.approx(1.0, abs=1e-4)


def test_colder_oil_is_thicker_and_drags_more():
    assert oil.viscosity(30.0) > oil.viscosity(40.0) > 0.03
    cold, warm = (oil.assembly(3, temperature) for temperature in (30.0, 50.0))
    for one, other in zip(cold[1:], warm[1:], strict=True):
        assert float(one["coefficient"].split()[0]) > float(other["coefficient"].split()[0])


def test_settings_reach_the_wanted_excitation(bench):
    measured = bench.case("kadmiri-2012/table1-500rpm")
    case = responses.at_excitation(measured, 2.0, "kadmiri-2012/fig12-1000rpm")
    assert responses.excitation(case) == pytest.approx(2.0, rel=1e-5)
    rig, harmonic = case.rig, case.scenario.motion.harmonics[0]
    inertial = rig.inertia * harmonic.amplitude * rig.base_radius_drive / rig.base_radius_loose * 2 * pi
    assert inertial * harmonic.frequency / rig.drag_torque == pytest.approx(2.0, rel=1e-5)
    assert harmonic.frequency == pytest.approx(2 * 500 / 60)


def test_impacts_on_a_stiff_flank_last_until_spring_and_damper_stop_pushing(bench):
    found = responses.durations(bench.case("kadmiri-2012/fig6-compliant", {"drag.torque": "0.893 N m"}), STEEL).mean()
    ratio, natural = 0.28, np.sqrt(STEEL / 0.38)
    damped = np.sqrt(1 - ratio**2)  # tan(damped*natural*t) = -2*ratio*damped/(1 - 2*ratio^2)
    ends = (pi - np.arctan(2 * ratio * damped / (1 - 2 * ratio**2))) / (damped * natural)
    assert found == pytest.approx(ends, abs=5e-6)  # one sample of 200 kHz
