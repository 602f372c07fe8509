"""Drag laws against values worked out by hand, and the directions in which they must go."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.laws import churning, drag, film

WHEEL = {"radius": 0.05, "face_width": 0.02, "depth": 0.05, "volume": 2e-3}
SPEEDS = st.floats(1.0, 70.0)  # churning in its first form: between the two forms its torque may fall
OIL = ((40.0, 34e-6), (100.0, 7e-6))


def test_run_down_obeys_the_torque_that_it_is_read_from():
    asymptote, start, rate, inertia = -22.0, 80.0, 0.31, 4e-3
    times = np.linspace(0.0, 4.0, 4001)
    speeds = drag.rundown(asymptote, start, rate, times)
    deceleration = -np.gradient(speeds, times)[1:-1]
    torque = drag.bearing(asymptote, rate, inertia, speeds)[1:-1]
    moving = speeds[2:] > 0  # both neighbours of the difference
    assert moving.sum() > 3900
    assert inertia * deceleration[moving] == pytest.approx(torque[moving], rel=1e-6)
    stop = np.log((start - asymptote) / -asymptote) / rate
    assert drag.rundown(asymptote, start, rate, stop - 1e-6) > 0.0
    assert drag.rundown(asymptote, start, rate, stop + 1e-6) == 0.0


def test_couette_by_hand():
    # 2*3.14159265 * 0.05 Pa s * 0.03 m * (0.015 m)^3 * 60 rad/s / 80 um = 9.424778e-3 * 3.375e-6 * 7.5e5
    assert drag.couette(0.05, 0.03, 0.015, 80e-6, 60.0) == pytest.approx(0.0238564, rel=1e-5)


def test_the_engaged_ratio_shears_at_the_differential_speed():
    loose, shaft = 40.0, 55.0
    neutral = drag.couette(0.03, 0.02, 0.02, 50e-6, loose)
    engaged = drag.couette(0.03, 0.02, 0.02, 50e-6, loose - shaft)
    assert engaged / neutral == pytest.approx(-15.0 / 40.0, rel=1e-12)  # the faster shaft drags the gear along


def test_seetharaman_sides_by_hand():
    # 0.0256*pi = 0.0804248; 0.12^4 = 2.0736e-4; sqrt(860*0.04*50^3) = sqrt(4.3e6) = 2073.644
    assert drag.seetharaman_sides(0.12, 860.0, 0.04, 50.0) == pytest.approx(0.0345821, rel=1e-5)


def test_churning_by_hand():
    # h/D 0.5^0.45 = 0.732043; V/D^3 2^0.1 = 1.071773; Fr 8.154944^-0.6 = 0.283889; Re 2857.143^-0.21 = 0.188042
    kinematic = 35e-6
    assert churning.torque_coefficient(**WHEEL, kinematic_viscosity=kinematic, speed=40.0) == pytest.approx(
        1.366 * 0.732043 * 1.071773 * 0.283889 * 0.188042, rel=1e-5
    )
    # S = 0.05^2*pi + 0.1*0.02*pi/2 = 0.01099557; 1/2*850*1600*S*1.25e-4*0.0572128
    assert churning.churning(**WHEEL, density=850.0, viscosity=850 * kinematic, speed=40.0) == pytest.approx(
        0.053472, rel=1e-4
    )


def test_fast_thin_churning_by_hand():
    # Omega R B/nu = 100*0.05*0.02/1e-6 = 1e5: 3.644 * 0.5^0.1 * 2^-0.35 * (1e4*0.05/9.81)^-0.88 * 0.2^0.85
    expected = 3.644 * 0.933033 * 0.784584 * 0.0314467 * 0.254609
    found = churning.torque_coefficient(**WHEEL, kinematic_viscosity=1e-6, speed=100.0)
    assert found == pytest.approx(expected, rel=2e-5)


def test_between_the_regimes_the_coefficient_lies_between_both_forms():
    speed = np.array([6000.0, 7500.0, 9000.0]) * 1e-6 / (0.05 * 0.02) * np.ones(3)
    low, middle, high = churning.torque_coefficient(**WHEEL, kinematic_viscosity=1e-6, speed=speed)
    just = churning.torque_coefficient(
        **WHEEL, kinematic_viscosity=1e-6, speed=speed * np.array([1 - 1e-9, 1.0, 1 + 1e-9])
    )
    assert just == pytest.approx([low, middle, high], rel=1e-6)  # no jump at either limit
    assert min(low, high) < middle < max(low, high)


def test_wetted_surface_at_its_limits():
    assert churning.wetted_surface(0.05, 0.02, 0.0) == 0.0
    full = churning.wetted_surface(0.05, 0.02, 0.1)
    assert full == pytest.approx(2 * np.pi * 0.05**2 + 2 * np.pi * 0.05 * 0.02, rel=1e-12)
    with pytest.raises(ValueError, match="between 0 and the diameter"):
        churning.wetted_surface(0.05, 0.02, 0.11)


def every_law(speed):
    return [
        drag.coulomb(0.2, speed),
        drag.viscous(1e-3, speed),
        drag.power(2e-3, 0.59, speed),
        drag.bearing(-20.0, 0.3, 4e-3, speed),
        drag.couette(0.03, 0.02, 0.02, 50e-6, speed),
        drag.seetharaman_sides(0.1, 850.0, 0.03, speed),
        churning.churning(**WHEEL, density=850.0, viscosity=0.03, speed=speed),
    ]


@given(SPEEDS, st.floats(1.01, 3.0))
def test_drag_resists_and_grows_with_speed(speed, factor):
    for slow, fast in zip(every_law(speed), every_law(speed * factor), strict=True):
        assert 0.0 < slow <= fast
    assert np.array(every_law(-speed)) == pytest.approx(-np.array(every_law(speed)), rel=1e-12)


@given(SPEEDS)
def test_an_assembly_is_the_sum_of_its_parts(speed):
    assert drag.assembly(every_law(np.array([speed, 0.0]))) == pytest.approx(
        [sum(float(part) for part in every_law(speed)), 0.0], rel=1e-12
    )


@given(st.floats(0.0, 120.0), st.floats(0.5, 20.0))
def test_warm_oil_is_thinner_lighter_and_drags_less(temperature, warmer):
    cold, warm = (film.dynamic_viscosity(OIL, 850.0, t) for t in (temperature, temperature + warmer))
    assert warm < cold
    assert film.density(850.0, temperature + warmer) < film.density(850.0, temperature)
    for law in (
        lambda mu: drag.couette(mu, 0.02, 0.02, 50e-6, 40.0),
        lambda mu: drag.seetharaman_sides(0.1, 850.0, mu, 40.0),
        lambda mu: churning.churning(**WHEEL, density=850.0, viscosity=mu, speed=1.0),
    ):
        assert law(warm) < law(cold)


def test_exponents_of_churning_and_shear():
    speeds, viscosities = np.array([20.0, 40.0]), np.array([0.03, 0.06])
    torque = churning.churning(**WHEEL, density=850.0, viscosity=0.03, speed=speeds)
    assert np.log2(torque[1] / torque[0]) == pytest.approx(0.59, abs=1e-12)
    torque = churning.churning(**WHEEL, density=850.0, viscosity=viscosities, speed=20.0)
    assert np.log2(torque[1] / torque[0]) == pytest.approx(0.21, abs=1e-12)
    torque = drag.seetharaman_sides(0.1, 850.0, 0.03, speeds)
    assert np.log2(torque[1] / torque[0]) == pytest.approx(1.5, abs=1e-12)


def test_viscosity_goes_through_its_points_and_between_by_hand():
    assert film.kinematic_viscosity(OIL, [40.0, 100.0]) == pytest.approx([34e-6, 7e-6], rel=1e-12)
    # loglog(34.7) = 0.1876946, loglog(7.7) = -0.0523855, log T 2.4957526, 2.5718834, at 75 degC 2.5417667
    slope = (-0.0523855 - 0.1876946) / (2.5718834 - 2.4957526)
    height = 0.1876946 + slope * (2.5417667 - 2.4957526)
    assert film.kinematic_viscosity(OIL, 75.0) * 1e6 == pytest.approx(10 ** (10**height) - 0.7, rel=1e-4)
    assert film.dynamic_viscosity(OIL, 850.0, 75.0) == pytest.approx(0.0097, abs=1e-4)


@pytest.mark.parametrize("points", [((40.0, 34e-6), (40.0, 7e-6)), ((40.0, 34e-6), (100.0, 0.2e-6))])
def test_points_that_give_no_law_are_refused(points):
    with pytest.raises(ValueError, match="give"):
        film.kinematic_viscosity(points, 50.0)
