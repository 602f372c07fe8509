"""Restitution, and the loose gear along the line of action, against values worked out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from gears3d.laws import contact

SHARES = st.floats(0.0, 1.0)


def test_restitution_by_hand():
    found = contact.restitution(0.6, [-0.03, 0.03], slope=-4.0, asymmetry=0.1, deviation=0.05, normal=[1.0, -2.0])
    assert found == pytest.approx([0.6 - 0.12 + 0.05 + 0.05, 0.6 - 0.12 - 0.05 - 0.1], abs=1e-15)


@given(st.floats(-1.0, 2.0), st.floats(-5.0, 5.0), st.floats(-20.0, 20.0), st.floats(-4.0, 4.0))
def test_restitution_stays_between_nothing_and_everything(base, velocity, slope, normal):
    assert 0.0 <= contact.restitution(base, velocity, slope, 0.3, 0.4, normal) <= 1.0


@given(st.floats(0.0, 0.5), st.floats(0.01, 0.5))
def test_hard_impacts_give_back_less(slow, more):
    law = contact.restitution(0.9, [slow, slow + more], slope=-0.8)
    assert law[1] < law[0]


def test_the_scatter_has_the_spread_asked_for():
    normal = np.random.default_rng(1).standard_normal(100_000)
    found = contact.restitution(0.5, np.full(100_000, -0.02), deviation=0.05, normal=normal)
    assert found.mean() == pytest.approx(0.5, abs=6 * 0.05 / np.sqrt(1e5))
    assert found.std() == pytest.approx(0.05, rel=6 / np.sqrt(2e5))


@given(st.floats(1e-6, 1.0))
def test_damping_ratio_and_restitution_undo_each_other(coefficient):
    assert contact.restitution_of(contact.damping_ratio(coefficient)) == pytest.approx(coefficient, rel=1e-7)


@given(SHARES, SHARES)
def test_more_damping_gives_back_less(one, other):
    low, high = sorted((one, other))
    assert contact.restitution_of(high) <= contact.restitution_of(low)
    assert contact.damping_ratio(high) <= contact.damping_ratio(low)


@pytest.mark.parametrize("coefficient", [0.1, 0.3, 0.5, 0.9])
def test_a_spring_and_damper_of_that_ratio_rebound_so(coefficient):
    ratio = float(contact.damping_ratio(coefficient))

    def out(_, state):
        return state[0]

    out.terminal, out.direction = True, 1.0
    flown = solve_ivp(
        lambda _, y: [y[1], -2 * ratio * y[1] - y[0]], (0, 20), [-1e-300, -1.0], events=out, rtol=1e-11, atol=1e-13
    )
    assert flown.y[1, -1] == pytest.approx(coefficient, abs=1e-8)


def test_table_one_by_hand():
    # 5.24 rad/s * 25.4 mm / 104.6 rad/s = 1.2724 mm; 0.821 N m / 51 mm = 16.098 N; 9.884e-4 / 0.051^2 = 0.38001 kg
    assert contact.drive_amplitude(5.24, 0.0254, 104.6) == pytest.approx(1.27243e-3, rel=1e-5)
    assert contact.drag_force(0.821, 0.051) == pytest.approx(16.09804, rel=1e-6)
    assert contact.equivalent_mass(9.884e-4, 0.051) == pytest.approx(0.3800077, rel=1e-6)


def test_the_reaction_vanishes_where_the_excitation_is_one():
    mass, force, omega = 0.38, 17.5, 156.9
    amplitude = force / (mass * omega**2)
    turned = np.linspace(0.0, 2 * np.pi, 1001)
    push = contact.reaction(force, mass, -amplitude * omega**2 * np.cos(turned))
    assert push.min() == pytest.approx(0.0, abs=1e-12)
    assert contact.reaction(force, mass, -100.0, 60.0) == pytest.approx(17.5 - 0.38 * 40, rel=1e-12)


@given(st.floats(-1.0, 1.0), SHARES)
def test_the_impulse_is_the_change_of_momentum(velocity, coefficient):
    rebound = -coefficient * velocity
    found = contact.impulse(0.38, velocity, coefficient)
    assert found == pytest.approx(0.38 * (rebound - velocity), abs=1e-12)
    unit = contact.dimensionless_impulse(found, 0.38, 0.68e-3, 156.9)
    assert unit * 0.38 * 0.68e-3 * 156.9 == pytest.approx(found, abs=1e-12)
