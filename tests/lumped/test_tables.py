"""Tabulated torques: straight lines between points, exact with a step cut at every point that is crossed."""

from math import inf, pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gears3d.effects import Gate, Variable, torque_table
from gears3d.effects import rows as form
from gears3d.errors import InputError
from gears3d.lumped.tables import lines
from tests.lumped.rig import RPM, simulate
from tests.lumped.test_effects import DRAG, RB, J

POINTS = {
    Variable.SPEED: ((0.5, -0.02), (1.0, 0.1), (1.7, 0.05), (2.2, 0.3), (2.9, 0.22), (3.3, 0.0)),
    Variable.ANGLE: ((0.1, 0.0), (0.4, 0.3), (0.45, -0.1), (0.9, 0.2)),
    Variable.TIME: ((0.05, 0.3), (0.1, -0.2), (0.31, 0.2)),
}


@pytest.mark.parametrize("variable", list(Variable))
def test_flights_follow_tables(variable):
    """Piece by piece with scipy, each to the point where the variable leaves it: no step over a corner there either."""
    start = 10.0 / RB if variable == Variable.ANGLE else 0.0
    points = tuple((x + start, y) for x, y in POINTS[variable])
    done = simulate(
        0.5, "free", 0.005, amplitude=0.0, backlash=20.0, rows=[torque_table(variable, points)],
    )  # fmt: skip
    x, y = np.array(points).T
    pick = [lambda t, s: s[1], lambda t, s: s[0], lambda t, s: t][variable]

    def right(t, s):
        return [s[1], -(DRAG + np.interp(pick(t, s), x, y)) / J]

    events = [lambda t, s, k=k: pick(t, s) - k for k in x]
    for event in events:
        event.terminal = True
    t, state, off = 0.0, [done.samples[0, 2], 30 * RPM], 0.0
    while t < 0.5:
        part = solve_ivp(
            right, (t, 0.5), state, "DOP853", events=events, rtol=1e-13, atol=1e-15, dense_output=True, max_step=4e-3
        )
        inside = (done.samples[:, 0] >= t) & (done.samples[:, 0] <= part.t[-1])
        if inside.any():
            off = max(off, np.abs(part.sol(done.samples[inside, 0]).T - done.samples[inside][:, [2, 4]]).max())
        if part.status == 0:
            break
        t, state = part.t[-1], part.y[:, -1]
        hop = 1e-9  # past the corner, where the parabola of this torque is exact to rounding
        pull = right(t, state)[1]
        t, state = t + hop, [state[0] + state[1] * hop + pull * hop**2 / 2, state[1] + pull * hop]
    assert off < 1e-11


def test_a_table_of_one_line_is_the_linear_law():
    """Impacts in flight, contact and on both flanks, the speed jumping over knots at every impact."""
    many = tuple((w, 0.02 * w) for w in np.linspace(-20.0, 20.0, 81))
    tabled = simulate(10.0, e=0.5, rows=[torque_table(Variable.SPEED, many)])
    linear = simulate(10.0, e=0.5, rows=[form.torque_linear(0.02)])
    assert tabled.counters["impacts"] == linear.counters["impacts"] > 200
    assert np.abs(tabled.impacts[:, 0] - linear.impacts[:, 0]).max() < 1e-10
    assert np.allclose(tabled.impacts[:, 2:5], linear.impacts[:, 2:5], rtol=1e-7, atol=1e-10)
    assert np.allclose(tabled.contacts, linear.contacts, atol=1e-10)


def test_dense_tables_tend_to_their_law():
    """Straight lines err by h²/8 of the curvature: four times the points, a sixteenth of the error."""
    off = []
    law = simulate(4.0, e=0.5, rows=[form.torque_power(0.01, 1.5)])
    for count in (33, 129):
        w = np.linspace(0.5, 6.0, count)
        table = torque_table(Variable.SPEED, tuple(zip(w, 0.01 * w**1.5, strict=True)))
        found = simulate(4.0, e=0.5, rows=[table])
        assert found.counters["impacts"] == law.counters["impacts"]
        off.append(np.abs(found.impacts[:, 0] - law.impacts[:, 0]).max())
    assert off[0] / off[1] == pytest.approx(16.0, rel=0.5)


@pytest.mark.parametrize("gate", [Gate.ACTIVE, Gate.CONTACT])
def test_tables_of_contact_shift_the_loss_of_contact(gate):
    """A constant table gives what a constant torque gives."""
    for row in (torque_table(v, ((0.0, 0.11), (1.0, 0.11), (2.0, 0.11)), gate) for v in Variable):
        done = simulate(1 / 3, rows=[row])
        lost = np.arccos(-(DRAG + 0.11) / (J * 6 * pi * 20 * RPM)) / (6 * pi)
        assert done.contacts[0, 2] == pytest.approx(lost, abs=1e-13)


def test_energy_of_a_torque_over_the_angle_is_kept():
    """J·ω²/2 + ∫T dθ + Td·θ over a thousand points."""
    angle = np.linspace(0.0, 2.0, 1001)
    torque = 0.1 * np.sin(7 * angle)
    row = torque_table(Variable.ANGLE, tuple(zip(angle, torque, strict=True)))
    done = simulate(0.4, "free", 0.004, amplitude=0.0, backlash=20.0, rows=[row])
    potential = np.concatenate([[0.0], np.cumsum((torque[1:] + torque[:-1]) / 2 * np.diff(angle))])
    theta = done.samples[:, 2]
    k = np.clip(np.searchsorted(angle, theta) - 1, 0, None)
    u, slope = theta - angle[k], np.diff(torque)[np.clip(k, 0, 999)] / np.diff(angle)[0]
    work = np.where(theta < 0, torque[0] * theta, np.where(theta > 2.0, potential[-1] + torque[-1] * (theta - 2.0), potential[k] + torque[k] * u + slope * u**2 / 2))  # fmt: skip  # noqa: E501
    energy = J * done.samples[:, 4] ** 2 / 2 + work + DRAG * theta
    assert np.abs(energy - energy[0]).max() < 1e-13


def test_tables_that_do_not_rise_are_refused():
    for points in ((), ((0.0, 1.0), (0.0, 2.0)), ((1.0, 0.0), (0.0, 0.0)), ((0.0, inf),), ((float("nan"), 0.0),)):
        with pytest.raises(InputError, match="do not rise or are not finite"):
            simulate(0.1, rows=[torque_table(Variable.SPEED, points)])


def test_lines_hold_their_ends():
    table = lines(Variable.TIME, [(1.0, 2.0)])
    assert table([0.0, 1.0, 5.0]).tolist() == [2.0, 2.0, 2.0]
