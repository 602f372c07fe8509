"""The film's laws: hand-computed values, Reynolds' equation, symmetry, the published pair."""

from math import atan, cos, pi, radians, sqrt, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson, quad, simpson, solve_ivp

from gears3d.laws import film
from gears3d.scenario import load

L, ETA, R = 0.0245, 0.01, 8.057e-3
OIL = (L, ETA, R)


def test_hand_computed_coefficients():
    assert film.wedge(2e-6, 0.02, 0.01, 0.008) == pytest.approx(1.6)  # 2·0.02·0.01·0.008/2e-6
    assert film.squeeze(0.008 / 100, 0.02, 0.01, 0.008) == pytest.approx(1.3328648814475097)  # 0.6·π/√2, 100^1.5 = 1000
    assert film.squeeze(0.008 / 100, 0.02, 0.01, 0.008) == pytest.approx(3 * pi * 0.02 * 0.01 / sqrt(2) * 1000)


def test_wedge_is_that_of_reynolds_equation():
    """p' = 6·η·u·(h − h*)/h³, h = h0 + x²/2R, no pressure far off; only the side that pushes counts."""
    h0, u = 3e-6, 2.0
    angle = np.linspace(-pi / 2 + 1e-6, pi / 2 - 1e-6, 40_001)  # x = √(2·R·h0)·tan(angle)
    x = sqrt(2 * R * h0) * np.tan(angle)
    h = h0 + x**2 / (2 * R)
    stretch = sqrt(2 * R * h0) / np.cos(angle) ** 2

    def rise(level):
        return 6 * ETA * u * (h - level) / h**3 * stretch

    level = simpson(h**-2 * stretch, x=angle) / simpson(h**-3 * stretch, x=angle)
    pressure = cumulative_simpson(rise(level), x=angle, initial=0)
    force = L * abs(simpson(np.where(angle > 0, pressure, 0.0) * stretch, x=angle))
    assert force == pytest.approx(film.wedge(h0, *OIL) * u, rel=1e-3)


def test_squeeze_is_half_of_reynolds_equation():
    """A full film: p = 6·η·v·R/h²; the printed coefficient is half of its force."""
    h0, v = 3e-6, 0.02
    width = sqrt(2 * R * h0)
    half = quad(lambda a: 6 * ETA * v * R / (h0 / cos(a) ** 2) ** 2 * width / cos(a) ** 2, 0, pi / 2)[0]
    assert L * half == pytest.approx(film.squeeze(h0, *OIL) * v, rel=1e-9)


def test_the_representative_pair():
    """On standard centres: req 8.057 mm, L 24.5 mm, u 3.12 m/s at 1500 rpm."""
    rig = load("scenarios/base/helical-17-43.toml").rig()
    radii, helix = (rig.base_radius_drive, rig.base_radius_loose), rig.base_helix_angle
    angle = atan(tan(radians(20)) / cos(radians(28)))
    assert film.equivalent_radius(*radii, angle, helix) == pytest.approx(8.057e-3, rel=1e-4)
    assert film.contact_length(16e-3, 1.372, helix) == pytest.approx(24.5e-3, rel=3e-3)
    v = rig.mean_speed * rig.base_radius_drive * tan(angle)
    u = film.entraining_speed(v, v, radians(28), helix)
    assert u == pytest.approx(3.12, rel=1e-3)
    assert 2 * rig.mean_speed * film.rolling_radius(radii[0], angle, helix) == pytest.approx(u, rel=1e-12)


@given(
    x=st.floats(-59e-6, 59e-6), v=st.floats(-0.1, 0.1), u=st.floats(-5, 5), floor=st.floats(0, 5e-6),
)  # fmt: skip
def test_both_films_together_are_odd(x, v, u, floor):
    here = film.mesh_film_force(x, v, 60e-6, u, *OIL, floor)
    there = film.mesh_film_force(-x, -v, 60e-6, u, *OIL, floor)
    assert here == pytest.approx(-there, rel=1e-12, abs=1e-30)


@given(h=st.floats(1e-7, 1e-4), rate=st.floats(-0.1, 0.1), u=st.floats(-5, 5))
def test_one_film_never_pulls_and_a_thinner_one_pushes_more(h, rate, u):
    force = film.film_force(h, rate, u, *OIL)
    assert force >= 0.0
    assert film.film_force(0.9 * h, rate, u, *OIL) >= force
    assert film.film_force(h, abs(rate), u, *OIL) == pytest.approx(film.wedge(h, *OIL) * abs(u))


def test_both_films_have_no_jump_amid_the_backlash_nor_at_the_floor():
    off = 1e-12
    for x in (0.0, 59e-6):
        force = [film.mesh_film_force(x + d, 0.01, 60e-6, 3.0, *OIL, 1e-6) for d in (-off, off)]
        assert force[1] == pytest.approx(force[0], rel=1e-5, abs=1e-6)
    assert film.film_force(0.5e-6, -0.01, 3.0, *OIL, 1e-6) == film.film_force(1e-6, -0.01, 3.0, *OIL)


def test_the_resting_film_carries_its_load():
    h0 = film.resting_thickness(1.8, 3.12, *OIL)
    assert film.film_force(h0, 0.0, 3.12, *OIL) == pytest.approx(1.8, rel=1e-14)


def test_squeezed_speed_is_the_integral_of_the_squeeze():
    def right(t, y):
        return [-y[1], -film.squeeze(y[0], *OIL) * y[1] / 1.2]

    done = solve_ivp(right, (0, 2.9e-3), [60e-6, 0.02], "DOP853", rtol=1e-12, atol=1e-16)
    h, v = done.y
    assert h[-1] < 10e-6
    assert np.abs(film.squeezed_speed(h, 60e-6, 0.02, 1.2, *OIL) / v - 1).max() < 1e-9
