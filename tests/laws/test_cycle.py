"""Cycles in closed form, the map of regimes, and riding on wavy flanks."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.laws import (
    REGIMES,
    SineDrive,
    border,
    dimensionless_backlash,
    regions,
    riding,
    threshold_amplitude,
    threshold_omega,
)
from gears3d.laws.excitation import excitation
from gears3d.laws.orbit import cycle

PULL = 0.22 * 0.148 / 0.0695


def swing(rpm, hertz):
    return SineDrive(0.148 * rpm * pi / 30, 2 * pi * hertz, PULL)


@pytest.mark.parametrize(
    ("rpm", "hertz", "backlash", "e", "active", "reverse"),
    [  # approach speeds [mm/s] of the rigid model at Rb = 0.148 m
        (4, 10, 200e-6, 0.3, [33.964, 10.676, 3.224, 0.969], [32.313, 9.918, 2.966, 0.888]),
        (20, 3, 250e-6, 0.5, [31.242, 17.467, 9.056, 4.597], [30.858, 17.174, 8.884, 4.505]),
    ],
)
def test_rebounds_to_every_digit(rpm, hertz, backlash, e, active, reverse):
    found = cycle(swing(rpm, hertz), backlash, lambda flank, speed: e, 1e-4)
    assert (found.regime, found.periods, found.why) == ("double_sided", 1, "")
    for flank, printed in ((0, active), (1, reverse)):
        speeds = [abs(flight.velocity) * 1e3 for flight in found.flights if flight.struck == flank]
        assert np.abs(np.array(speeds[:4]) - printed).max() <= 5.01e-4


def test_light_loss_is_single_sided():
    found = cycle(swing(5, 1), 250e-6)
    (flight,) = found.flights
    assert found.regime == "single_sided"
    assert flight.lost == pytest.approx(2.865716, abs=6e-7)
    assert flight.hit == pytest.approx(3.974947, abs=6e-7)
    assert flight.velocity * 1e3 == pytest.approx(-4.23930, abs=6e-6)
    assert flight.height * 1e6 == pytest.approx(79.96, abs=6e-3)
    assert cycle(swing(1.6, 3), 250e-6).regime == "contact"
    assert cycle(swing(5, 1), 50e-6).regime == "unknown"  # the reverse flank does not push where it is struck
    assert "does not last" in cycle(swing(5, 1), 50e-6).why


@given(size=st.floats(1.02, 25), gap=st.floats(1e-3, 3))
@settings(max_examples=60, deadline=None)
def test_the_map_is_the_cycle_of_every_point(size, gap):
    found = cycle(SineDrive(1.0, 1.0, 1.0 / size), gap)
    edge = border(np.array([size]))[0]
    if abs(gap / edge - 1) > 1e-3:  # the map looks its crossings up in 400 samples a period
        code = REGIMES[regions(np.array([size]), np.array([gap]))[0, 0]]
        assert code == found.regime
        assert (gap < edge) == any(flight.struck == 1 for flight in found.flights)


def test_the_border_grows_from_the_threshold():
    """Near Λ = 1 the flight is a quartic: its height goes with (Λ - 1)²."""
    heights = border(1.0 + np.array([1e-4, 1e-3]))
    assert np.log10(heights[1] / heights[0]) == pytest.approx(2.0, abs=0.01)
    assert (np.diff(border(np.geomspace(1.01, 30, 40))) > 0).all()


def test_kadmiris_thresholds():
    """Table 1 of Kadmiri et al. 2012: Λ = 0.346, 0.328, 0.363, 0.334 from m, H, ω, F."""
    rows = [(52.3, 4.83e-3, 14.5), (104.6, 1.27e-3, 16.1), (156.9, 0.68e-3, 17.5), (209.2, 0.38e-3, 18.9)]
    found = [excitation(0.38, stroke, omega, force) for omega, stroke, force in rows]
    assert np.round(found, 3) == pytest.approx([0.346, 0.328, 0.363, 0.334])
    assert dimensionless_backlash(0.2e-3, 0.68e-3) == pytest.approx(0.294, abs=1e-3)


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 10), st.floats(0.1, 1e3), st.floats(0.2, 5))
def test_at_the_thresholds_the_excitation_is_one(inertia, torque, omega, ratio):
    amplitude = threshold_amplitude(inertia, torque, omega, ratio)
    assert threshold_omega(inertia, torque, amplitude, ratio) == pytest.approx(omega)
    radius = 0.1  # of the loose gear
    stroke = amplitude * ratio * radius / omega
    assert excitation(inertia / radius**2, stroke, omega, torque / radius) == pytest.approx(1.0)


def test_riding_is_the_derivative_of_itself():
    waves = [(0, 3, 20e-6, 0.3), (0, 90, 4e-6, 1.0), (1, 5, 30e-6, -0.7)]
    time = np.linspace(0, 1, 200_001)
    omega = 6 * pi
    angle = 3.0 * time - 2.0 / omega * (np.cos(omega * time) - 1)
    drive = (angle, 3.0 + 2.0 * np.sin(omega * time), 2.0 * omega * np.cos(omega * time))
    loose, speed, acceleration = riding((0.1, 0.07), drive, waves)
    assert np.abs(np.gradient(loose, time) - speed)[1:-1].max() < 1e-6
    assert np.abs(np.gradient(speed, time) - acceleration)[1:-1].max() < 1e-4
    own = sum(size * np.cos(order * angle + phase) for gear, order, size, phase in waves if gear == 0)
    mate = sum(size * np.cos(order * loose + phase) for gear, order, size, phase in waves if gear == 1)
    assert np.abs(0.07 * loose - 0.1 * angle - own - mate).max() < 1e-15
