"""The rigid model at the ends of its parameters, and the loss of contact on flanks with a transmission error."""

from math import acos, cos, pi, sin

import numpy as np
import pytest
from scipy.optimize import brentq

from gears3d.effects import Flank, Gear
from gears3d.effects import rows as form
from tests.lumped.rig import RPM, bench, run, simulate

SPEED, OMEGA = 0.148 * 4 * RPM, 2 * pi * 10.0
PULL = 0.22 / 0.0695 * 0.148


def crossing_speed(backlash):
    """Return the speed of the first impact on the reverse flank, 4 rpm at 10 Hz, e = 0 [m/s]."""
    impacts = simulate(0.1, amplitude=4 * RPM, frequency=10.0, backlash=backlash).impacts
    return impacts[impacts[:, 1] == 1][0, 2]


def test_a_vanishing_backlash_is_crossed_by_the_jerk_alone():
    phase = acos(-PULL / (SPEED * OMEGA))
    jerk = SPEED * OMEGA**2 * sin(phase)  # the relative acceleration is zero where contact is lost
    gaps = np.array([1e-9, 1.25e-10, 1.5625e-11])
    off = np.array([crossing_speed(gap) / (0.5 * jerk ** (1 / 3) * (6 * gap) ** (2 / 3)) - 1 for gap in gaps])
    assert np.abs(off).max() < 2e-2
    assert off[:-1] / off[1:] == pytest.approx(2.0, rel=0.03)  # the next term grows with the time of flight, b^(1/3)


def test_a_vanishing_drag_loses_contact_where_the_drive_is_fastest():
    drags = np.array([0.02, 0.002, 0.0002])
    lost = [simulate(0.1, amplitude=4 * RPM, frequency=10.0, drag=drag).contacts[0, 2] * OMEGA for drag in drags]
    excitation = SPEED * OMEGA / (drags / 0.0695 * 0.148)
    assert np.array(lost) - pi / 2 == pytest.approx(np.arcsin(1 / excitation), abs=1e-12)


def test_without_drag_a_flight_keeps_the_speed_of_the_loose_gear():
    impacts = simulate(0.2, amplitude=4 * RPM, frequency=10.0, drag=0.0, e=0.6).impacts
    after = impacts[:-1, 3] + np.sin(OMEGA * impacts[:-1, 0]) * SPEED
    before = impacts[1:, 2] + np.sin(OMEGA * impacts[1:, 0]) * SPEED
    free = np.diff(impacts[:, 0]) > 0
    stuck = impacts[:-1, 3] == 0.0  # permanent contact follows, which changes the speed
    assert (free & ~stuck).sum() > 5
    assert after[free & ~stuck] == pytest.approx(before[free & ~stuck], abs=1e-12)


@pytest.mark.parametrize(("orders", "phases"), [((1,), (0.7,)), ((1, 3), (0.2, 2.0)), ((2, 30), (1.0, 4.0))])
def test_a_transmission_error_adds_its_own_accelerations(orders, phases):
    """Contact is lost where θ̈1 + φ'·θ̈1 + φ''·θ̇1² < -T/J; Rigaud & Perret-Liaudet 2020, eqs (2) and (6)."""
    amplitude, omega, mean = 3 * RPM, 2 * pi * 3.0, 30 * RPM
    sizes = [40e-6 / order**1.5 for order in orders]
    rows = []
    for order, size, phase in zip(orders, sizes, phases, strict=True):
        rows.append(form.flank_harmonic(Gear.DRIVE, Flank.ACTIVE, order, size, phase))
    outcome = run(bench(amplitude=amplitude, frequency=3.0, rows=rows), 0.3, start="active")

    def margin(t):
        theta = mean * t - amplitude / omega * (cos(omega * t) - 1)
        speed, acceleration = mean + amplitude * sin(omega * t), amplitude * omega * cos(omega * t)
        own = acceleration
        for order, size, phase in zip(orders, sizes, phases, strict=True):
            turn = order * theta + phase
            own += size / 0.148 * (-order * sin(turn) * acceleration - order**2 * cos(turn) * speed**2)
        return own + 0.22 / 0.0695

    times = np.linspace(0.0, 0.3, 3001)
    first = times[np.flatnonzero(np.array([margin(t) for t in times]) < 0)[0]]
    assert outcome.contacts[0, 2] == pytest.approx(brentq(margin, first - 1e-4, first, xtol=1e-15), abs=1e-12)
