"""The perfectly plastic orbit and its rebounds; published equations, roots found to 30 digits."""

from math import acos, cos, pi, sin

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.lumped.rig import RPM, simulate

# amplitude [rpm], frequency [Hz], backlash [m]; t1..t4 [ms]; reverse and active approach velocity [mm/s]
ORBITS = [
    ((4, 10, 200e-6), (26.91886, 44.50170, 73.08114, 90.25652), (32.3132, -33.9644)),
    ((20, 3, 250e-6), (87.59170, 111.6544, 245.7416, 269.6574), (30.8581, -31.2425)),
    ((5, 3, 250e-6), (100.6546, 140.4915, 232.6787, 270.8483), (18.0340, -19.6954)),
]


def half_unit(text):
    return 0.5 * 10.0 ** -len(str(text).split(".")[1])


@pytest.mark.parametrize(("about", "times", "speeds"), ORBITS)
def test_orbit_to_all_printed_digits(about, times, speeds):
    rpm, frequency, backlash = about
    done = simulate(1 / frequency, amplitude=rpm * RPM, frequency=frequency, backlash=backlash)
    (t1, t2), (t3, t4) = (done.contacts[0, 2], done.contacts[1, 1]), (done.contacts[1, 2], done.contacts[2, 1])
    assert done.contacts[:, 0].tolist() == [0, 1, 0]
    for ours, printed in zip((t1, t2, t3, t4), times, strict=True):
        assert abs(ours * 1e3 - printed) <= half_unit(printed) * 1.001
    assert done.impacts[:, 1].tolist() == [1, 0]
    for ours, printed in zip(done.impacts[:, 2], speeds, strict=True):
        assert abs(ours * 1e3 - printed) <= half_unit(printed) * 1.001


@pytest.mark.parametrize(("about", "times", "speeds"), ORBITS)
def test_orbit_solves_the_published_equations(about, times, speeds):
    """Rigaud & Perret-Liaudet 2020, eqs (17)-(19)."""
    rpm, frequency, b = about
    omega, dv, f = 2 * pi * frequency, 0.148 * rpm * RPM, 0.22 * 0.148 / 0.0695
    t1 = acos(-f / (omega * dv)) / omega
    t3 = 2 * pi / omega - t1

    def fall(ti, t, gap):
        swing = dv / omega * (cos(omega * t) - cos(omega * ti))
        return f / 2 * (t - ti) ** 2 - dv * sin(omega * ti) * (t - ti) - swing + gap

    t2 = brentq(lambda t: fall(t1, t, b), t1 + 1e-4, t3, xtol=1e-15)
    t4 = brentq(lambda t: fall(t3, t, -b), t3 + 1e-4, t3 + 1 / frequency / 2, xtol=1e-15)
    done = simulate(1.2 / frequency, amplitude=rpm * RPM, frequency=frequency, backlash=b)
    ours = [done.contacts[0, 2], done.contacts[1, 1], done.contacts[1, 2], done.contacts[2, 1]]
    assert np.abs(np.array(ours) - [t1, t2, t3, t4]).max() < 1e-13


def test_light_losses_fall_back_on_the_same_flank():
    done = simulate(1.0, amplitude=5 * RPM, frequency=1.0)
    assert done.contacts[0, 2] * 2 * pi == pytest.approx(2.865716, abs=6e-7)
    assert done.impacts[:, 1].tolist() == [0]
    assert done.impacts[0, 0] * 2 * pi == pytest.approx(3.974947, abs=6e-7)
    assert done.impacts[0, 2] * 1e3 == pytest.approx(-4.23930, abs=6e-6)
    assert done.impacts[0, 6] * 1e6 == pytest.approx(79.96, abs=6e-3)


def test_below_the_threshold_contact_is_never_lost():
    done = simulate(20 / 3, amplitude=1.6 * RPM)
    assert done.counters["impacts"] == 0
    assert done.contacts.tolist() == [[0, 0, pytest.approx(20 / 3)]]


@pytest.mark.parametrize(
    ("rpm", "frequency", "backlash", "e", "active", "reverse"),
    [
        (4, 10, 200e-6, 0.3, [33.964, 10.676, 3.224, 0.969], [32.313, 9.918, 2.966, 0.888]),
        (20, 3, 250e-6, 0.5, [31.242, 17.467, 9.056, 4.597], [30.858, 17.174, 8.884, 4.505]),
    ],
)
def test_approach_speeds_of_rebounds(rpm, frequency, backlash, e, active, reverse):
    done = simulate(1 / frequency, amplitude=rpm * RPM, frequency=frequency, backlash=backlash, e=e)
    for flank, printed in ((0, active), (1, reverse)):
        ours = np.abs(done.impacts[done.impacts[:, 1] == flank, 2])[:4] * 1e3
        assert np.abs(ours - printed).max() <= 5.01e-4
