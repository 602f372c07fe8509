"""Torques that the effects of this package do not send yet, and torques that act in one place only."""

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
import pytest

from gears3d.effects import Gate, Row, Variable, torque_constant, torque_table
from gears3d.engine import simulate
from gears3d.lumped import rigid
from tests.effects.bench import DRAG, bench, first_flight, off


@dataclass(frozen=True)
class Bare:
    """An effect that is one row."""

    row: Row
    kind = "bare"

    def rows(self, rig):
        return [self.row]


def with_row(row, **changes):
    return replace(bench(**changes), effects=(Bare(row),))


TABLES = {
    "speed": (Variable.SPEED, [(0.0, 0.3), (4.0, -0.05), (6.0, 0.1)], lambda t, theta, omega: omega),
    "angle": (Variable.ANGLE, [(0.2, 0.0), (0.35, 0.1), (0.6, 0.02)], lambda t, theta, omega: theta),
    "time": (Variable.TIME, [(0.05, 0.1), (0.1, -0.05), (0.11, 0.05)], lambda t, theta, omega: t),
}


@pytest.mark.parametrize("case", TABLES)
def test_tabulated_torque(case):
    """The flight as scipy solves it; kinks of the table are crossed in the middle of steps."""
    variable, points, at = TABLES[case]
    x, y = np.transpose(points)
    expected = first_flight(lambda t, theta, omega: DRAG + np.interp(at(t, theta, omega), x, y))
    case = with_row(torque_table(variable, tuple(points)))
    assert off(simulate(case), expected) < 2e-6
    assert off(rigid.simulate(case), expected) < 2e-6


@pytest.mark.parametrize("variable", list(Variable))
def test_a_table_is_constant_beyond_its_ends(variable):
    row = torque_table(variable, ((100.0, 0.05), (200.0, 7.0)))
    assert off(simulate(with_row(row)), first_flight(lambda t, theta, omega: DRAG + 0.05)) < 1e-7
    row = torque_table(variable, ((-2.0, 7.0), (-1.0, 0.05)))
    assert off(simulate(with_row(row)), first_flight(lambda t, theta, omega: DRAG + 0.05)) < 1e-7


def test_a_fine_table_is_the_law_it_was_taken_from():
    grid = np.linspace(-0.1, 1.0, 551)
    points = tuple((x, 0.05 * cos(30 * x)) for x in grid)
    expected = first_flight(lambda t, theta, omega: DRAG + 0.05 * cos(30 * theta))
    assert off(simulate(with_row(torque_table(Variable.ANGLE, points))), expected) < 1e-4
    assert sin(30 * grid[-1]) != 0.0


@pytest.mark.parametrize("gate", [Gate.FLIGHT, Gate.CONTACT, Gate.ACTIVE, Gate.REVERSE])
@pytest.mark.parametrize("torque", [0.1, -0.1])
def test_torques_of_one_place_leave_no_chatter_and_the_twins_motion(gate, torque):
    """Where torques of contact would part the flanks and those of flight close them, contact goes on in both models."""
    case = with_row(torque_constant(torque, gate), run__duration="0.7 s")
    engine, twin = simulate(case), rigid.simulate(case)
    assert len(engine.impacts["time_s"]) == len(twin.impacts["time_s"])
    assert engine.impacts["time_s"] == pytest.approx(twin.impacts["time_s"], abs=1e-8)
    high = np.abs(twin.impacts["velocity_m_s"]) > 1e-3
    assert engine.impacts["velocity_m_s"][high] == pytest.approx(twin.impacts["velocity_m_s"][high], rel=1e-6)
