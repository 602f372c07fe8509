"""Yielding flanks: the spring and damper take the place of the restitution law."""

from math import exp, log, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gears3d.effects import Gate, gap_spring, torque_constant
from tests.lumped.rig import RPM, bench, run, simulate

MASS, FORCE = 0.0695 / 0.148**2, 0.22 / 0.148


def restitution(zeta):
    """Of a linear spring and damper that let go where their force ends, before the gap opens again."""
    root = sqrt(1 - zeta**2)
    return exp(-zeta / root * np.arctan2(2 * zeta * root, -(1 - 2 * zeta**2)))


def damping(e, stiffness):
    """What makes rebounds of ``e``."""
    return 2 * brentq(lambda zeta: restitution(zeta) - e, 1e-6, 0.99) * sqrt(stiffness * MASS)


def test_energy_is_kept_without_damping():
    done = run(bench(amplitude=0.0, rows=[gap_spring(1e6, 0.0)])._replace(tolerance=1e-12), 5.0, 1e-4, "free")
    s, v = done.samples[:, 5], done.samples[:, 6]
    energy = 0.5 * MASS * v**2 + FORCE * s + 0.5 * 1e6 * np.minimum(s, 0.0) ** 2
    assert done.counters["impacts"] > 50
    assert np.abs(energy / energy[0] - 1).max() < 1e-10
    assert np.abs(done.impacts[:, 3] / -done.impacts[:, 2] - 1).max() < 1e-9
    load = FORCE * (pi + 2 * np.arctan(FORCE / np.sqrt(1e6 * MASS) / done.impacts[0, 3])) * sqrt(MASS / 1e6)
    assert done.impacts[0, 4] == pytest.approx(2 * MASS * done.impacts[0, 3] + load, rel=1e-9)


@pytest.mark.parametrize("e", [0.3, 0.6])
def test_stiff_flanks_tend_to_the_rigid_result(e):
    rigid = simulate(2 / 3, e=e)
    first = rigid.impacts[rigid.impacts[:, 6] > 3e-5]
    off = []
    for stiffness in (1e8, 1e10):
        soft = simulate(2 / 3, rows=[gap_spring(stiffness, damping(e, stiffness))])
        found = soft.impacts[soft.impacts[:, 6] > 3e-5]
        assert np.array_equal(found[:, 1], first[:, 1])
        off.append(np.abs(found[:, 2] / first[:, 2] - 1).max())
    assert off[1] < 5e-3
    assert off[0] / off[1] > 8  # the drag over a passage counts like stiffness^(-1/2)


def test_a_passage_follows_an_independent_integration():
    k, c, fall = 2.6e6, 500.0, FORCE / MASS
    done = simulate(0.1, "free", 2e-6, amplitude=0.0, rows=[gap_spring(k, c)])
    entry = sqrt(250e-6 / fall)
    assert done.impacts[0, 0] == pytest.approx(entry, abs=1e-12)
    assert done.impacts[0, 2] == pytest.approx(-fall * entry, rel=1e-12)

    def right(t, y):
        return [y[1], -fall + (max(0.0, -k * y[0] - c * y[1]) if y[0] < 0 else 0.0) / MASS, 0.0]

    def clear(t, y):
        return y[0]

    clear.terminal, clear.direction = True, 1
    theirs = solve_ivp(
        right, (entry, 0.1), [-1e-18, -fall * entry, 0.0], "DOP853", events=clear, rtol=1e-12, atol=1e-15,
        max_step=2e-6, dense_output=True,
    )  # fmt: skip
    assert done.impacts[0, 3] == pytest.approx(theirs.y[1, -1], rel=1e-6)
    inside = (done.samples[:, 0] > entry) & (done.samples[:, 0] < theirs.t[-1])
    assert inside.sum() > 100
    assert np.abs(done.samples[inside, 5] - theirs.sol(done.samples[inside, 0])[0]).max() < 1e-12
    duration = theirs.t[-1] - entry
    impulse = MASS * (done.impacts[0, 3] - done.impacts[0, 2]) + FORCE * duration
    assert done.impacts[0, 4] == pytest.approx(impulse, rel=1e-6)


def test_the_force_never_pulls():
    """Overdamped: the gear creeps back at no more than free fall away from the flank would allow."""
    done = simulate(2.0, spacing=1e-4, rows=[gap_spring(1e7, 2e4)])
    s, v = done.samples[:, 5], done.samples[:, 6]
    pushed = np.where(s < 0, np.maximum(0.0, -1e7 * s - 2e4 * v), 0.0)
    pushed -= np.where(s > 250e-6, np.maximum(0.0, 1e7 * (s - 250e-6) + 2e4 * v), 0.0)
    drive = 0.148 * 20 * RPM * 6 * pi * np.cos(6 * pi * done.samples[:, 0])
    acceleration = np.gradient(v, 1e-4)
    smooth = np.abs(np.gradient(acceleration)) < 0.05
    assert smooth.mean() > 0.9
    assert np.abs(acceleration - (-FORCE + pushed) / MASS + drive)[smooth].max() < 0.1
    assert done.counters["impacts"] >= 10


def test_permanent_contact_on_a_spring_is_one_contact():
    done = simulate(1.0, amplitude=1.0 * RPM, spacing=1e-3, rows=[gap_spring(1e7, 1e3)])
    assert done.counters["impacts"] == 0
    assert done.contacts.tolist() == [[0, 0, 1.0]]
    depth = -done.samples[:, 5] * 1e7
    expected = FORCE + MASS * 0.148 * RPM * 6 * pi * np.cos(6 * pi * done.samples[:, 0])
    assert np.abs(depth / expected - 1)[300:].max() < 0.02
    settled = simulate(1.0, "free", amplitude=0.0, rows=[gap_spring(1e7, 3e3)])
    assert settled.impacts[-1, 3] == 0.0
    assert settled.impacts[-1, 4] == pytest.approx(-MASS * settled.impacts[-1, 2])
    assert settled.contacts[0, 1] == settled.impacts[-1, 0]


def test_torques_of_contact_act_while_pressed():
    extra = torque_constant(0.22, Gate.CONTACT)
    done = simulate(1.0, amplitude=0.0, spacing=0.1, rows=[gap_spring(1e7, 1e3), extra])
    assert done.samples[-1, 5] == pytest.approx(-2 * FORCE / 1e7, rel=1e-9)


@pytest.mark.parametrize("e", [0.2, 0.5, 0.8])
def test_damping_loses_what_theory_says(e):
    off = []
    for k in (1e8, 1e10):
        done = simulate(0.03, "free", amplitude=0.0, rows=[gap_spring(k, damping(e, k))])
        off.append(abs(-done.impacts[0, 3] / done.impacts[0, 2] - e))
    assert off[1] < 2e-3
    assert 8 < off[0] / off[1] < 12


def test_light_damping_is_that_of_half_a_period():
    """Rigaud & Perret-Liaudet 2020, eq. (20) with its square: e of a flank that may pull until the gap opens."""
    zeta = -log(0.98) / sqrt(pi**2 + log(0.98) ** 2)
    assert restitution(zeta) == pytest.approx(0.98, rel=1e-4)
