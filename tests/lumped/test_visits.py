"""Paths between the flanks: against closed forms of fall, rebound, oscillator and squeezed oil."""

import numpy as np
import pytest

from gears3d.laws import film
from gears3d.lumped import visits as paths

STEP = 1.25e-4


def law(**numbers):
    made = np.zeros(paths.NUMBERS)
    made[paths.MASS] = 1.0
    for name, value in numbers.items():
        made[getattr(paths, name.upper())] = value
    return made


def still(points, forced=0.0, wide=1e-3, flank=0.0):
    """Return a grid on which the active flank stands, or moves at a speed."""
    given = np.zeros((points, paths.COLUMNS))
    given[:, paths.FORCED] = forced
    given[:, paths.LOW] = flank * STEP * np.arange(points)
    given[:, paths.HIGH] = given[:, paths.LOW] + wide
    given[:, paths.LOW_RATE] = given[:, paths.HIGH_RATE] = flank
    return given


def path(numbers, start, given):
    out = np.zeros(len(given))
    paths.follow(numbers, np.array(start), given, STEP, out)
    return out


@pytest.mark.parametrize("flank", [0.0, 0.3])
def test_a_fall_and_its_rebounds_are_those_of_the_restitution_law(flank):
    given, time = still(400, forced=-2.0, flank=flank), STEP * np.arange(400)
    found = path(law(restitution=0.5, slope=2.0, stick=1e-4), (1e-4, flank - 0.02), given) - flank * time
    hit = (-0.02 + np.sqrt(0.02**2 + 4e-4)) / 2.0
    speed = np.sqrt(0.02**2 + 4e-4)
    back = (0.5 + 2.0 * speed) * speed
    after = time - hit
    true = np.where(after < 0.0, 1e-4 - 0.02 * time - time**2, back * after - after**2)
    first = after < back  # lands again after v/g·2 = back
    assert np.abs(found - true)[first].max() < 1e-11


def test_a_gear_that_does_not_rebound_rides_until_it_would_have_to_be_pulled():
    time = STEP * np.arange(800)
    turn, swing = 60.0, 1e-3
    given = still(800, forced=-1.0, wide=1.0)
    given[:, paths.LOW] = swing * np.sin(turn * time)
    given[:, paths.LOW_RATE] = swing * turn * np.cos(turn * time)
    found = path(law(stick=1e-4), (1e-6, 0.0), given)
    leaves = np.arcsin(1.0 / (swing * turn**2)) / turn  # where the flank falls back as fast as a free gear
    on = (time > 1e-3) & (time < leaves)
    assert np.abs(found - given[:, paths.LOW])[on].max() < 1e-9
    later = (time > leaves) & (time < leaves + 0.01)
    x = time - leaves
    free = swing * np.sin(turn * leaves) + swing * turn * np.cos(turn * leaves) * x - 0.5 * x**2
    assert np.abs(found - free)[later].max() < 2e-8


def test_teeth_that_yield_swing_as_a_damped_oscillator():
    stiffness, damping = 4e4, 40.0
    given, time = still(400), STEP * np.arange(400)
    found = path(law(stiffness=stiffness, damping=damping), (-1e-13, -0.02), given)
    decay = 0.5 * damping
    turn = np.sqrt(stiffness - decay**2)
    true = -0.02 / turn * np.exp(-decay * time) * np.sin(turn * time)
    pressed = time < np.arctan2(turn, -decay + 1e-300) / turn  # until the damper would have to pull
    assert np.abs(found - true)[pressed].max() < 1e-9


def test_friction_lessens_the_force_of_one_flank_and_adds_to_that_of_the_other():
    given, time = still(200), STEP * np.arange(200)
    for start, factor in (((0.0, -0.02), 0.7), ((1e-3, 0.02), 1.3)):
        found = path(law(stiffness=4e4, friction=0.3), start, given) - start[0]
        turn = np.sqrt(factor * 4e4)
        pressed = time < np.pi / turn
        assert np.abs(found - start[1] / turn * np.sin(turn * time))[pressed].max() < 1e-9


def test_squeezed_oil_takes_the_speed_that_its_law_says():
    oil = {"length": 0.02, "viscosity": 0.05, "radius": 0.01}
    squeeze = float(film.squeeze(1.0, **oil))
    given = still(200)
    found = path(law(squeeze=squeeze, layer=1e-6), (1e-4, -0.05), given)
    speed = np.gradient(found, STEP)
    falls = (found > 1.2e-5) & (speed < 0.0)
    falls[0] = False
    true = film.squeezed_speed(found[falls], 1e-4, 0.05, 1.0, **oil)
    assert np.count_nonzero(falls) > 5
    assert -speed[falls] == pytest.approx(true, rel=2e-3)


def test_the_wedge_carries_a_load_at_its_resting_thickness():
    oil = {"length": 0.02, "viscosity": 0.05, "radius": 0.01}
    given = still(8000, forced=-1.0)
    given[:, paths.ROLLING] = 2.0
    numbers = law(wedge=float(film.wedge(1.0, **oil)), squeeze=float(film.squeeze(1.0, **oil)), layer=1e-6)
    end = path(numbers, (5e-5, 0.0), given)[-1]
    both = 1.0 / end - 1.0 / (1e-3 - end)
    assert numbers[paths.WEDGE] * 2.0 * both == pytest.approx(1.0, rel=1e-3)


def test_means_are_those_of_the_path():
    given = np.stack([still(41, forced=-2.0)] * 2)
    starts, out = np.array([[1e-4, 0.0], [2e-4, 0.01]]), np.zeros((2, 10))
    paths.follow_all(law(restitution=0.4, stick=1e-4), starts, 0.0, given, np.array([41, 21]), STEP, 4, out)
    one = path(law(restitution=0.4, stick=1e-4), starts[0], given[0])
    parts = [np.trapezoid(one[k : k + 5]) / 4.0 for k in range(0, 40, 4)]
    assert out[0] == pytest.approx(parts, abs=1e-15)
    assert not out[1, 5:].any()


def test_flanks_may_lie_further_up():
    given, moved = np.stack([still(41, forced=-2.0)] * 2), np.zeros((2, 10))
    starts, out = np.array([[1e-4, 0.0], [2e-4, 0.01]]), np.zeros((2, 10))
    own, sizes = law(restitution=0.4, stick=1e-4), np.array([41, 41])
    paths.follow_all(own, starts, 0.0, given, sizes, STEP, 4, out)
    paths.follow_all(own, starts + np.array([3e-5, 0.0]), 3e-5, given, sizes, STEP, 4, moved)
    assert moved - 3e-5 == pytest.approx(out, abs=1e-15)
