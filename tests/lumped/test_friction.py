"""Friction in the mesh: it changes forces and impulses between rigid flanks, and the motion on yielding ones."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gears3d.effects import gap_spring, impact_slope, torque_friction, torque_linear
from gears3d.errors import InputError
from tests.lumped.rig import RPM, simulate

MASS, FORCE, MU = 0.0695 / 0.148**2, 0.22 / 0.148, 0.1


@pytest.mark.parametrize("rows", [[], [torque_linear(0.01)], [impact_slope(-2.0), torque_linear(0.01, 1.0)]])
@pytest.mark.parametrize("spacing", [1e-3, np.inf])
def test_rigid_impacts_keep_their_motion_and_take_another_impulse(rows, spacing):
    """J·Δω = Rb2·I·(±1 − µ): more impulse where friction works against the push, less where both brake."""
    without = simulate(2.0, e=0.5, rows=rows, spacing=spacing).impacts
    having = simulate(2.0, e=0.5, rows=[*rows, torque_friction(MU)], spacing=spacing).impacts
    assert np.allclose(np.delete(having, 4, 1), np.delete(without, 4, 1), rtol=1e-11, atol=1e-15)
    expected = np.where(without[:, 1] == 0, 1 / (1 - MU), 1 / (1 + MU))
    assert np.abs(having[:, 4] / without[:, 4] / expected - 1).max() < 1e-12


def test_a_yielding_flank_in_lasting_contact_bears_the_friction_too():
    rows = [gap_spring(1e7, 1e3), torque_friction(MU)]
    active = simulate(1.0, amplitude=0.0, spacing=0.1, rows=rows).samples[-1, 5]
    assert -active * 1e7 == pytest.approx(FORCE / (1 - MU), rel=1e-9)
    turned = simulate(1.0, start="reverse", mean=-30 * RPM, amplitude=0.0, spacing=0.1, rows=rows).samples[-1, 5]
    assert (turned - 250e-6) * 1e7 == pytest.approx(FORCE / (1 - MU), rel=1e-9)


def test_a_passage_with_friction_follows_an_independent_integration():
    k, c, fall = 2.6e6, 500.0, FORCE / MASS
    done = simulate(0.1, "free", 2e-6, amplitude=0.0, rows=[gap_spring(k, c), torque_friction(MU)])
    entry = (250e-6 / fall) ** 0.5

    def right(t, y):
        force = max(0.0, -k * y[0] - c * y[1]) if y[0] < 0 else 0.0
        return [y[1], -fall + (1 - MU) * force / MASS, force]

    def clear(t, y):
        return y[0]

    clear.terminal, clear.direction = True, 1
    theirs = solve_ivp(
        right, (entry, 0.1), [-1e-18, -fall * entry, 0.0], "DOP853", events=clear, rtol=1e-12, atol=1e-15,
        max_step=2e-6,
    )  # fmt: skip
    assert done.impacts[0, 3] == pytest.approx(theirs.y[1, -1], rel=1e-6)
    assert done.impacts[0, 4] == pytest.approx(theirs.y[2, -1], rel=1e-6)


def test_friction_holds_a_gear_at_rest_on_a_yielding_flank():
    """Pulled on a standing flank: it comes to rest within the band that friction of µ·N bears, and stays."""
    pull = 0.1 / 0.148
    rows = [gap_spring(1e5, 2.0), torque_linear(1e-3, -100.0), torque_friction(0.3)]
    done = simulate(3.0, "free", 1e-3, amplitude=0.0, mean=0.0, drag=0.0, rows=rows)
    force = -done.samples[-1, 5] * 1e5
    assert (done.samples[-500:, 4] == 0.0).all()
    assert pull / 1.3 <= force <= pull / 0.7
    assert abs(force / pull - 1) > 1e-3


def test_friction_that_blocks_is_refused():
    with pytest.raises(InputError, match="blocks the mesh"):
        simulate(1.0, rows=[torque_friction(0.6), torque_friction(0.4)])
